#!/usr/bin/env bash
# Renders the pictures of the demo that README.md shows into a folder, as PNG.
#   scripts/readme_pictures.sh [FOLDER]      default: out/readme
set -euo pipefail
out=${1:-out/readme}
. "$(dirname "$0")/program.sh"

# Name, hour, and a camera where it is not that of the scene.
while read -r name hour camera; do
    "$canopy" render assets/scenes/demo.ron --out "$out/$name.png" --size 1280x720 --at "2026-06-21T$hour-04:00" \
        ${camera:+--camera "$camera"} --quiet
    echo "$out/$name.png"
done <<'PICTURES'
afternoon 15:40
dawn 06:40
dusk 20:25
night 23:50
high 11:00 500,1500,2600,335,-22
crowns 19:20 990,40,-510,333,-4
wood 13:00 600,1.7,-500,300,8
PICTURES
