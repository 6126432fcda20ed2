#!/bin/sh
# Runs every scene of tests/scenes that moves by modes with the command-line program $1 twice, in 64 bits, once with a library
# built without the guard, into the folder $2, and compares what each shell wrote byte for byte: where it agrees the guard is
# inactive. A shell that feels it fails.
set -eu
root=$(CDPATH='' cd -- "$(dirname -- "$0")/.." && pwd)
cd "$root"
cli=$1
out=$2
cargo rustc --quiet --release --lib --crate-type cdylib --target-dir "$out/target" -- --cfg unguarded
same=0
differ=
for scene in tests/scenes/*.toml; do
    name=$(basename "$scene" .toml)
    grep -q '^\[comparison\]\|^ *method *= *"\(shell-implicit\|shell-explicit\)"' "$scene" && continue
    rm -rf "${out:?}/$name"
    "$cli" run "$scene" --quiet --double --out "$out/$name/with"
    LD_PRELOAD=$out/target/release/libshellwarp.so "$cli" run "$scene" --quiet --double --out "$out/$name/without"
    for cache in "$out/$name"/with/*.pc2; do
        shell=$(basename "$cache" .pc2)
        if cmp -s "$cache" "$out/$name/without/$shell.pc2" &&
            cmp -s "${cache%.pc2}_frames.csv" "$out/$name/without/${shell}_frames.csv"; then
            same=$((same + 1))
        else
            differ="$differ $shell"
        fi
    done
done
echo "check-guard: $same shells move the same without the guard; it acts on${differ:- none}"
[ -z "$differ" ]
