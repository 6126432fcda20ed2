#!/bin/sh
# Fuzzes each target for a sixth of $1 seconds with the sanitizer $2 (none or address), from the kept corpus and what earlier
# searches found, in target/fuzz. One process at low priority. A finding stays in target/fuzz/found; when it is fixed its input
# goes to tests/fuzz/corpus, which `make test` replays.
set -eu
seconds=$(($1 / 6))
root=$(CDPATH='' cd -- "$(dirname -- "$0")/../.." && pwd)
cd "$root"
cargo +nightly fuzz --version >/dev/null 2>&1 || {
    echo "fuzz: needs a nightly Rust and cargo-fuzz: rustup toolchain install nightly && cargo install cargo-fuzz"
    exit 1
}
failed=
for target in saved calls contact material mesh proxy; do
    mkdir -p "target/fuzz/corpus/$target" "target/fuzz/found/$target"
    nice -n 19 cargo +nightly fuzz run --fuzz-dir tests/fuzz --target-dir target/fuzz --sanitizer "$2" \
        --no-trace-compares -O -a "$target" "target/fuzz/corpus/$target" "tests/fuzz/corpus/$target" -- \
        -artifact_prefix="target/fuzz/found/$target/" -max_total_time="$seconds" -max_len=600 -timeout=20 \
        -print_final_stats=1 2>&1 | grep -E 'stat::number|panicked|ERROR|Test unit written|^error' || true
    ls "target/fuzz/found/$target" | grep -q . && failed="$failed $target"
done
[ -z "$failed" ] || { echo "fuzz: findings in$failed"; exit 1; }
echo "fuzz: OK"
