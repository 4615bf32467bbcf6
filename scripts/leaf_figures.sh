#!/usr/bin/env bash
# Traces figures 3.9 to 3.15 of [Franzke 2005] from the scenes of assets/scenes/leaf: each plant with the sun on it and
# against the light, by the layers of its leaves and by the standard model, with the time and the noise of each.
#   scripts/leaf_figures.sh [FOLDER] [SAMPLES]      default: out/leaf-figures 16
set -euo pipefail
out=${1:-out/leaf-figures}
samples=${2:-16}
. "$(dirname "$0")/program.sh"

# Name, size, and what shows the plant against the light.
figures="leaf 600x800
letters 600x800
potted_rubber 800x800 2026-06-21T18:00+01:00
potted_spider 800x800 2026-06-21T18:00+01:00
potted_begonia 800x800 2026-06-21T18:00+01:00
bush 800x800 2026-06-21T18:00+01:00
courtyard 1024x768 2026-06-21T09:00+01:00"

TIMEFORMAT='%R %U'
printf '%-15s %-6s %-9s %9s %11s  %s\n' figure light leaves seconds processor "samples, standard error of the luminance"
while read -r name size evening; do
    for light in front back; do
        from=()
        if [ "$light" = back ]; then
            from=(--along 10s ${evening:+--at "$evening"})
        fi
        for leaf in layers standard; do
            spent=$({ time "$canopy" reference "assets/scenes/leaf/$name.ron" --out "$out/$name-$light-$leaf.png" \
                --size "$size" --spp "$samples" --leaf "$leaf" "${from[@]}" > /dev/null 2> "$out/notes.txt"; } 2>&1)
            error=$(grep -o '[0-9]* samples, standard error.*' "$out/notes.txt" || true)
            read -r seconds processor <<< "$spent"
            printf '%-15s %-6s %-9s %9.1f %11.1f  %s\n' "$name" "$light" "$leaf" "$seconds" "$processor" "${error:-not told}"
        done
    done
done <<< "$figures"
rm -f "$out/notes.txt"
