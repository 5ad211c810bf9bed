#!/usr/bin/env bash
# Draws the picture of every example anew, with the commands that the examples' READMEs give for it.
set -euo pipefail
cd "$(dirname "$0")/.."
gmlc=${GMLC:-${CARGO_TARGET_DIR:-target}/release/gmlc}
grep -h '^gmlc mesh .*\.png$' examples/*/README.md | while read -r _ arguments; do
  # shellcheck disable=SC2086 # the arguments are words
  "$gmlc" $arguments
done
