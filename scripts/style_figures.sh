#!/usr/bin/env bash
# Renders the pictures of styles that README.md shows, and measures the five kinds of scene of [Luft 2006, table 2].
#   scripts/style_figures.sh [FOLDER]      default: out/styles
set -euo pipefail
out=${1:-out/styles}
. "$(dirname "$0")/program.sh"

# The demo in each style.
while read -r name options; do
    # shellcheck disable=SC2086 # Options are words.
    "$canopy" render assets/scenes/demo.ron --out "$out/$name.png" --size 960x540 $options --quiet
    echo "$out/$name.png"
done <<'PICTURES'
photograph
watercolour --style watercolour
sepia --style watercolour --palette sepia --paper rough
lines --style lines
toon --style toon
PICTURES

# Small plants, trees, and an orbit that shows how calm the paint is.
for scene in bush rubber_plant begonia broadleaf conifer; do
    "$canopy" render "assets/scenes/style/$scene.ron" --out "$out/$scene.png" --size 720x720 --quiet
    echo "$out/$scene.png"
done
"$canopy" render assets/scenes/style/broadleaf.ron --out "$out/orbit" --frames 50 --fps 25 --size 480x480 --quiet
echo "$out/orbit"
if command -v img2webp >/dev/null; then
    img2webp -loop 0 -lossy -q 70 -d 80 "$out"/orbit/*.png -o "$out/orbit.webp"
    echo "$out/orbit.webp"
fi

# Frame times, step by step: passes of points.csv and frames.csv.
for scene in bush rubber_plant begonia broadleaf conifer; do
    "$canopy" profile "assets/scenes/style/$scene.ron" --out "$out/profile_$scene" --each --sweep style=photograph --reference none \
        --rounds 4 --size 720x720 --frames 3
done
