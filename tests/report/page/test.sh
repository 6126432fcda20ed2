#!/bin/sh
# Tests the page of the report in DIRECTORY: what it holds, and in headless Chromium where node and a browser are installed.
set -eu
here=$(CDPATH='' cd -- "$(dirname -- "$0")" && pwd)
page=$1/index.html

fail() {
    echo "test-report: $*" >&2
    exit 1
}

[ -s "$page" ] || fail "$page is missing"
[ "$(wc -c <"$page")" -lt 26214400 ] || fail "$page is larger than 25 MB"
if grep -Eq '(src|href)="?https?:' "$page"; then fail "$page asks for the network"; fi
for table in errors times choice next_factor_of_two convergence_modes error_kinds elastica precompute; do
    [ "$(wc -l <"$1/$table.csv")" -gt 1 ] || fail "$table.csv has no rows"
done
if ! command -v node >/dev/null || [ ! -d "$here/node_modules/playwright-core" ]; then
    echo "skipped: node or playwright-core is not installed, so the page was not opened (install node, then make report)"
    exit 0
fi
code=0
node "$here/test.mjs" "$page" || code=$?
[ "$code" -eq 77 ] || exit "$code"
