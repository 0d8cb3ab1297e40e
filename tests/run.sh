#!/usr/bin/env bash
# Installs what is missing, builds with warnings as errors, and runs the tests.
#   tests/run.sh [--slow] [arguments of ctest, e.g. -R mesh]
# Without --slow the tests labelled `slow` are left out. The build is in build/release.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

selection=(-LE slow)
if [[ "${1:-}" == --slow ]]; then
  selection=()
  shift
fi

./apps/setup.sh
cmake --preset release -DLAMINA_TESTS=ON -DLAMINA_BENCH=ON -DLAMINA_WERROR=ON
cmake --build --preset release -j "$(./apps/jobs.sh)"
ctest --test-dir build/release --output-on-failure -j "$(nproc)" "${selection[@]}" "$@"
