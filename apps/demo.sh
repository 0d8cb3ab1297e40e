#!/usr/bin/env bash
# From nothing to two boundary-layer meshes: installs what is missing, builds, meshes the Ahmed body in its channel and
# a cow, and says where the files lie (out/demo, or the folder given as first argument).
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
out="${1:-out/demo}"

# Quiet unless it fails.
quietly() {
  local log
  log="$(mktemp)"
  if ! "$@" >"$log" 2>&1; then
    cat "$log" >&2
    rm -f "$log"
    exit 1
  fi
  rm -f "$log"
}

./apps/setup.sh
echo "build: build/release/lamina"
quietly cmake --preset release
quietly cmake --build --preset release --target lamina -j "$(./apps/jobs.sh)"
lamina=build/release/lamina

# mesh NAME BODY options: everything the program can write of one body, in a folder of its own.
mesh() {
  local name="$1" body="$2" folder="$out/$1" status=0
  shift 2
  mkdir -p "$folder"
  echo
  echo "== $name"
  "$lamina" mesh "$body" "$@" -o "$folder/$name.vtu" --levelset "$folder/$name.vdb" --report "$folder/report.json" \
    --picture "$folder/$name.png" || status=$?
  # 3: the mesh is there, and what it missed was said.
  [[ $status -eq 0 || $status -eq 3 ]] || exit "$status"
}

mkdir -p "$out"
"$lamina" sample ahmed -o "$out/ahmed.stl"
mesh ahmed "$out/ahmed.stl" --case assets/cases/ahmed.toml
mesh spot assets/bodies/spot.stl --hmin 3e-3 --h2 0.2 --h1 1

echo
echo "files:"
find "$out" -type f | sort | sed 's/^/  /'
