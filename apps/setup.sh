#!/bin/sh
# Installs what building, running and testing Lamina needs on Debian 12, and nothing else.
# A second call finds everything present and changes nothing.
set -eu

# Compilers, generators and the tools that the scripts call.
packages="g++ cmake ninja-build ccache git pkg-config"
# Libraries. FindOpenVDB of Debian also wants Boost.Iostreams, Blosc and Imath; the last two come with libopenvdb-dev.
packages="$packages libopenvdb-dev libboost-iostreams-dev libtbb-dev libtet1.5-dev libeigen3-dev libfmt-dev"
packages="$packages libcli11-dev libtoml11-dev nlohmann-json3-dev libcairo2-dev libdeflate-dev libhdf5-dev libcgns-dev"
# Tests, benchmarks and lint: C++ frameworks, and the independent readers that act as oracles.
packages="$packages libgtest-dev libbenchmark-dev clang-format-14 clang-tidy-14"
packages="$packages python3-numpy python3-h5py python3-meshio python3-vtk9 python3-openvdb"

is_installed() {
  [ "$(dpkg-query -W -f '${db:Status-Status}' "$1" 2>/dev/null)" = installed ]
}

missing=""
for package in $packages; do
  is_installed "$package" || missing="$missing $package"
done
if [ -z "$missing" ]; then
  echo "setup: all packages are present"
  exit 0
fi

as_root=""
if [ "$(id -u)" -ne 0 ]; then
  command -v sudo >/dev/null || { echo "setup: need root or sudo to install:$missing" >&2; exit 1; }
  as_root="sudo"
fi

log=$(mktemp)
trap 'rm -f "$log"' EXIT
install() {
  # shellcheck disable=SC2086 # a list of package names
  $as_root env DEBIAN_FRONTEND=noninteractive apt-get -qq -y --no-install-recommends install $missing >"$log" 2>&1
}
# The package lists may be absent or stale, so one failure is followed by an update and a second try.
if ! install; then
  if ! { $as_root apt-get -qq update >"$log" 2>&1 && install; }; then
    cat "$log" >&2
    echo "setup: could not install:$missing" >&2
    exit 1
  fi
fi
echo "setup: installed$missing"
