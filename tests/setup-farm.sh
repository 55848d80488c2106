#!/bin/sh
# Installs what the tests of farms (tests/farm) run: Slurm, as Debian 12 and 13 package it, and the command line of Open Job
# Description, in a folder of its own. Does nothing where they are there; uses sudo only where it is not run as root. Without them
# those tests say so and pass.
set -eu
cd "$(dirname "$0")/.."

packages="slurmctld slurmd slurm-client munge python3-venv"
missing=""
for package in $packages; do
    if ! dpkg-query -W -f '${Status}' "$package" 2>/dev/null | grep -q 'install ok installed'; then
        missing="$missing $package"
    fi
done
if [ -n "$missing" ]; then
    as_root=""
    if [ "$(id -u)" -ne 0 ]; then
        if ! command -v sudo >/dev/null 2>&1; then
            echo "setup-farm: not root and no sudo; ask an administrator to run: apt-get install$missing" >&2
            exit 1
        fi
        as_root="sudo"
    fi
    echo "setup-farm: installing these Debian packages:$missing" >&2
    $as_root apt-get update -qq
    # shellcheck disable=SC2086  # one word a package
    $as_root env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends $missing >/dev/null
fi

# All versions named: what is tested against does not change by itself.
target=${CARGO_TARGET_DIR:-target}
venv=$target/openjd
wanted="openjd-cli==0.8.0 openjd-model==0.13.0 openjd-sessions==0.13.0"
if [ "$(cat "$venv/wanted" 2>/dev/null)" != "$wanted" ]; then
    echo "setup-farm: installing $wanted to $venv" >&2
    rm -rf -- "$venv"
    mkdir -p -- "$target"
    # Debian's own, which python3-venv belongs to.
    /usr/bin/python3 -m venv "$venv"
    # shellcheck disable=SC2086  # one word a package
    "$venv/bin/pip" install --quiet --disable-pip-version-check $wanted
    echo "$wanted" >"$venv/wanted"
fi
