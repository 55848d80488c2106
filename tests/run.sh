#!/bin/sh
# Passes the tests: installs what is missing, then runs every test of the workspace.
set -eu
cd "$(dirname "$0")/.."
sh ffi/setup.sh
exec cargo test --workspace --quiet "$@"
