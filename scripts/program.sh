# shellcheck shell=bash
# Sourced by scripts that make pictures into the folder `out`. Goes to the root of the repository, makes the folder, and leaves the
# program in `canopy`.
cd "$(dirname "${BASH_SOURCE[0]}")/.."
canopy=${CANOPY:-${CARGO_TARGET_DIR:-target}/release/canopy}
[ -x "$canopy" ] || { echo "error: $canopy is not there; run ./run build or name the program in CANOPY" >&2; exit 1; }
mkdir -p "${out:?}"
