#!/bin/sh
# Passes the tests: installs what is missing, then runs every test of the workspace, and says what became of damaged files.
set -eu
cd "$(dirname "$0")/.."
sh ffi/setup.sh
table="${CARGO_TARGET_DIR:-target}/tmp/damaged-files.txt"
rm -f "$table"
status=0
cargo test --workspace --quiet "$@" || status=$?
[ ! -f "$table" ] || cat "$table"
exit "$status"
