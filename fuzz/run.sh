#!/usr/bin/env bash
# Fuzzes every reader that runs in the program's own process: bash fuzz/run.sh [SECONDS [TARGET…]]
#
# Builds the targets with stable Rust and g++ (libFuzzer comes with the crate libfuzzer-sys; cargo-fuzz, clang and nightly Rust are not needed), runs
# each for so many seconds (60), two for every processor at a time, and prints a table. Ends with 1 if anything crashed, hung or took too much memory; the
# file that did it is kept. What is found worth keeping by the way is kept too, beside the seeds of fuzz/corpus, and goes on from there the next time.
set -euo pipefail
cd "$(dirname "$0")/.."
seconds=${1:-60}
shift $(($# > 0))
targets=("$@")
[ $# -gt 0 ] || targets=(pbrt ply nvdb exr image ies text worker)
out=${CARGO_TARGET_DIR:-target}/fuzz
host=$(rustc -vV | sed -n 's/^host: //p')

# What cargo-fuzz passes, but for what only nightly Rust has (AddressSanitizer: nothing here is unsafe). `--target` keeps it off build scripts.
flags="--cfg fuzzing -Cpasses=sancov-module -Ccodegen-units=1"
for argument in level=4 inline-8bit-counters pc-table trace-compares; do
    flags+=" -Cllvm-args=-sanitizer-coverage-$argument"
done
bins=()
for target in "${targets[@]}"; do bins+=(--bin "$target"); done
RUSTFLAGS="$flags" cargo build --quiet --release --manifest-path fuzz/Cargo.toml --target "$host" --target-dir "$out" "${bins[@]}"

mkdir -p "$out/found" "$out/logs"
# In memory, where there is such a place: whole scenes are written and read thousands of times a second.
scratch=$(mktemp -d -p /dev/shm 2>/dev/null || mktemp -d)
trap 'rm -rf "$scratch"' EXIT

fuzz() {
    local target=$1 corpus=$out/corpus/$1 most=4096 seeds=() dictionary=()
    mkdir -p "$corpus"
    [ ! -d "fuzz/corpus/$target" ] || seeds+=("fuzz/corpus/$target")
    [ "$target" != nvdb ] || { seeds+=(tests/data/nanovdb); most=40000; }
    [ ! -f "fuzz/dictionaries/$target.dict" ] || dictionary=("-dict=fuzz/dictionaries/$target.dict")
    # A single allocation that is too large is stopped by the address space, what piles up by what is resident.
    ulimit -v $((6 << 20))
    ulimit -c 0
    rm -f "$out/found/$target-"*
    TMPDIR=$scratch RAYON_NUM_THREADS=1 "$out/$host/release/$target" -max_total_time="$seconds" -max_len="$most" -timeout=20 -rss_limit_mb=2048 \
        -malloc_limit_mb=1024 -print_final_stats=1 -artifact_prefix="$out/found/$target-" "${dictionary[@]}" "$corpus" "${seeds[@]}" \
        >"$out/logs/$target" 2>&1 || true
}

most_at_once=$((2 * $(nproc)))
for target in "${targets[@]}"; do
    while [ "$(jobs -rp | wc -l)" -ge "$most_at_once" ]; do wait -n || true; done
    fuzz "$target" &
done
wait

printf '%-8s %12s %14s %10s %12s %14s\n' target executions "new features" crashes "slowest (s)" "memory (MiB)"
failed=0
for target in "${targets[@]}"; do
    number() { sed -n "s/^stat::$1: *//p" "$out/logs/$target" | tail -1; }
    crashes=$(find "$out/found" -name "$target-*" | wc -l)
    executions=$(number number_of_executed_units)
    printf '%-8s %12s %14s %10s %12s %14s\n' "$target" "${executions:--}" "$(number new_units_added)" "$crashes" \
        "$(number slowest_unit_time_sec)" "$(number peak_rss_mb)"
    # One that did not even run has found nothing.
    if [ "$crashes" -gt 0 ] || [ -z "$executions" ]; then
        failed=1
        echo "$target failed: the end of $out/logs/$target"
        tail -n 25 "$out/logs/$target"
    fi
done
exit $failed
