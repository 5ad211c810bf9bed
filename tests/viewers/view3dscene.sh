#!/usr/bin/env bash
# Takes a picture of every mode of an X3D file in view3dscene: view3dscene.sh FILE.x3d FOLDER
set -euo pipefail
file=$1 folder=$2
mkdir -p "$folder"
for mode in 0 1 2 3 4 5 6; do
  timeout 120 xvfb-run -a -s "-screen 0 1024x768x24" view3dscene --no-sound --hide-extras --hide-menu \
    --geometry 800x600 --viewpoint "$mode" --screenshot 1 "$folder/view3dscene-$mode.png" "$file" \
    >"$folder/view3dscene-$mode.log" 2>&1 || echo "mode $mode: see $folder/view3dscene-$mode.log"
done
