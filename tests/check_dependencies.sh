#!/bin/sh
# Checks the dependencies by cargo-deny, without the network: licences and sources, and advisories where their database is at hand.
# What cannot be checked here is told in a line that begins with "skipped: ".
set -eu
cd "$(dirname -- "$0")/.."

if ! cargo deny --version >/dev/null 2>&1; then
    echo "skipped: licences, sources and advisories of dependencies: cargo-deny is not installed (cargo install --locked cargo-deny)"
    exit 0
fi
# The dependencies' manifests, of every platform: cargo fetch has them.
if ! cargo metadata --locked --offline --format-version 1 >/dev/null 2>&1; then
    echo "skipped: licences, sources and advisories of dependencies: not all are downloaded (cargo fetch --locked)"
    exit 0
fi
cargo deny --locked --offline --log-level warn check licenses sources
databases=${CARGO_HOME:-$HOME/.cargo}/advisory-dbs
if [ -d "$databases" ] && [ -n "$(ls -A "$databases")" ]; then
    cargo deny --locked --offline --log-level warn check --disable-fetch advisories
else
    echo "skipped: advisories of dependencies: there is no database in $databases (cargo deny fetch db)"
fi
