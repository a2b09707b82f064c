#!/bin/sh
# install-deps.sh - the Debian packages that building, testing and benchmarking need. Installs only what is missing; when
# nothing is, it is silent and done in an instant. MOCAPKIT_NO_INSTALL=1 skips it.
set -eu
[ "${MOCAPKIT_NO_INSTALL:-0}" = 1 ] && exit 0

packages="g++ cmake ninja-build ccache pkg-config git
libtorch-dev libopenblas-dev libeigen3-dev libcli11-dev libhdf5-dev libfmt-dev libspdlog-dev libzip-dev libpugixml-dev zlib1g-dev libssl-dev libpcre2-dev
nlohmann-json3-dev libtomlplusplus-dev libfast-float-dev librandom123-dev libcairo2-dev libgtest-dev libbenchmark-dev
python3-numpy python3-h5py python3-scipy hdf5-tools locales"

if ! command -v apt-get > /dev/null || ! command -v dpkg-query > /dev/null; then
  cat >&2 <<'TEXT'
install-deps: no apt-get here, so nothing is installed. Provide these through modules or CMAKE_PREFIX_PATH (a list of
  prefixes, e.g. CMAKE_PREFIX_PATH=$HOME/libtorch:$HOME/.local):
    a C++20 compiler (g++ 12 or newer), CMake 3.25, Ninja, pkg-config
    Eigen 3.4, CLI11 2.1, HDF5 1.10 to 1.14 (C), fmt 9, spdlog 1.10, nlohmann-json 3, toml++ 3, fast_float, Random123,
    libzip, pugixml, zlib, PCRE2 (8 bit), OpenSSL (crypto), cairo
    OpenBLAS with LAPACK; LibTorch 1.13 or 2.x (without it only the file tools are built)
    GoogleTest for the tests (-DMOCAPKIT_TESTS=OFF without), google-benchmark (-DMOCAPKIT_BENCH=OFF),
    python3 with numpy, h5py and scipy for the tests, localedef with its sources for the German one
TEXT
  exit 0
fi

installed=$(dpkg-query -W -f '${db:Status-Abbrev} ${Package}\n' 2> /dev/null | sed -n 's/^ii *//p')
missing=
for package in $packages; do
  printf '%s\n' "$installed" | grep -qxF "$package" || missing="$missing $package"
done
[ -z "$missing" ] && exit 0

echo "install-deps: installing$missing" >&2
sudo=
if [ "$(id -u)" != 0 ]; then
  if ! command -v sudo > /dev/null; then
    echo "install-deps: neither root nor sudo: ask for these packages:$missing" >&2
    exit 1
  fi
  sudo=sudo
fi
$sudo apt-get update -qq
# shellcheck disable=SC2086  # a list of words
$sudo env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends $missing
