#!/bin/sh
# Installs the Debian packages that Lanternfish is built with. Knows Debian 12 and 13; does nothing where they are there;
# uses sudo only where it is not run as root.
set -eu

common="g++ libembree-dev libopenvdb-dev libboost-dev"
. /etc/os-release
case "${ID:-}:${VERSION_ID:-}" in
    debian:12) packages="$common libclang1-14 libclang-common-14-dev" ;;
    debian:13) packages="$common libclang1-19 libclang-common-19-dev" ;;
    *)
        echo "setup: this is ${PRETTY_NAME:-an unknown system}; Lanternfish knows Debian 12 and 13." >&2
        echo "setup: install a C++ compiler, Embree 3.13 or 4, OpenVDB, Boost headers and libclang yourself, or build with" >&2
        echo "setup: 'cargo build --release --no-default-features' for the pure-Rust renderer without .vdb files." >&2
        exit 0
        ;;
esac

if ! command -v cargo >/dev/null 2>&1; then
    echo "setup: cargo is not on the PATH; install Rust 1.89 or newer first." >&2
    exit 1
fi

missing=""
for package in $packages; do
    if ! dpkg-query -W -f '${Status}' "$package" 2>/dev/null | grep -q 'install ok installed'; then
        missing="$missing $package"
    fi
done
[ -n "$missing" ] || exit 0

as_root=""
if [ "$(id -u)" -ne 0 ]; then
    if ! command -v sudo >/dev/null 2>&1; then
        echo "setup: not root and no sudo; ask an administrator to run: apt-get install$missing" >&2
        exit 1
    fi
    as_root="sudo"
fi
echo "setup: installing these Debian packages:$missing" >&2
$as_root apt-get update -qq
# shellcheck disable=SC2086  # one word a package
$as_root env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends $missing >/dev/null
