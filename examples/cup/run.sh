#!/usr/bin/env bash
# The paper's cup: scans an octagonal cup with the virtual laser scanner (once), fits the round cup to it, and documents
# the difference in out/cup.
set -euo pipefail
cd "$(dirname "$0")/../.."
cargo build --release
gmlc=${CARGO_TARGET_DIR:-target}/release/gmlc
if ! [ -e out/cup_scan.ply ]; then
  "$gmlc" scan examples/cup/octagonal_cup.gml -o out/cup_scan.ply --truth out/cup_truth.json --seed 7
fi
"$gmlc" inspect examples/cup/cup.gml out/cup_scan.ply -o out/cup
