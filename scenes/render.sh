#!/bin/sh
# Renders the main job: installs what is missing, builds, makes the scene with its own .vdb files, renders it.
# Leaves out/pier.exr and out/pier.png.
set -eu
cd "$(dirname "$0")/.."
sh ffi/setup.sh
cargo build --release --quiet
target/release/lanternfish scene pier --out out/pier
exec target/release/lanternfish render out/pier/pier.pbrt -o out/pier.exr --png out/pier.png "$@"
