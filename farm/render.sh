#!/bin/bash
# A sequence in pieces, by GNU parallel:
#   farm/render.sh SCENE FOLDER FRAMES PIECES [arguments of parallel, such as --sshloginfile machines, -j 2, --retries 3]
set -eu
if [ $# -lt 4 ]; then
  echo "usage: $0 SCENE FOLDER FRAMES PIECES [arguments of parallel]" >&2
  exit 2
fi
scene=$1 folder=$2 frames=$3 pieces=$4
shift 4
# shellcheck disable=SC2086 # Several arguments in one variable.
seq "$pieces" | parallel --halt soon,fail=1 "$@" \
  "${CANOPY:-canopy}" render "$scene" --out "$folder" --frames "$frames" --chunk "{}/$pieces" --skip-existing ${CANOPY_ARGUMENTS:-}
