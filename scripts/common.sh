# shellcheck shell=bash disable=SC2034
# SPDX-License-Identifier: MIT
# Sourced by the scripts beside it: packages, configuring, building.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

# What the programs are built from.
program_packages=(cmake ninja-build g++ libglm-dev libxsimd-dev libcli11-dev nlohmann-json3-dev libstb-dev
                  libtinyobjloader-dev)
# What the tests and benchmarks need besides.
test_packages=(catch2 libbenchmark-dev libboost-dev libmpfr-dev libeigen3-dev python3)
# Left out where the distribution has none: CMake then leaves out what needs them.
optional_packages=(libosd-dev clang libomp-dev libembree-dev python3-matplotlib)

as_root() {
  if [ "$(id -u)" -eq 0 ]; then "$@"; else sudo "$@"; fi
}

# Prints those of "$@" that are not installed.
missing_packages() {
  local package
  for package in "$@"; do
    [ "$(dpkg-query -W -f '${db:Status-Status}' "$package" 2>/dev/null)" = installed ] || echo "$package"
  done
}

# Installs those of "$@" that are missing, and no others; where it cannot, it says which packages are meant and goes on.
install_packages() {
  if ! command -v apt-get >/dev/null || ! command -v dpkg-query >/dev/null; then
    echo "No apt here: what follows needs, by their Debian names, $*"
    return
  fi
  local missing package available=()
  mapfile -t missing < <(missing_packages "$@")
  [ "${#missing[@]}" -gt 0 ] || return 0
  if [ "$(id -u)" -ne 0 ] && ! command -v sudo >/dev/null; then
    echo "Neither root nor sudo: missing are the packages ${missing[*]}"
    return
  fi
  echo "Installing ${missing[*]}"
  as_root apt-get update -qq || echo "apt-get update failed, going on with the package lists at hand"
  for package in "${missing[@]}"; do
    if apt-cache show "$package" >/dev/null 2>&1; then
      available+=("$package")
    else
      echo "This distribution has no package $package"
    fi
  done
  if [ "${#available[@]}" -gt 0 ]; then
    as_root env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends "${available[@]}" >/dev/null ||
      echo "apt-get install failed, going on with what there is"
  fi
}

# configure <preset> [<option of cmake>...]
configure() {
  cmake --preset "$@"
}

# build <preset> [<option of cmake --build>...]
build() {
  cmake --build --preset "$1" --parallel "$(nproc)" "${@:2}"
}
