#!/usr/bin/env bash
# Installs what the project needs and is not there yet: Debian packages with apt when root or sudo is available (otherwise it prints the exact
# line and stops), ap_types out of a pinned wheel into .env/, and with --tools the pinned Python tools of lint and register generation
# into .env/py, LiteX for the boards' memories into .env/litex, and what only tests look through (Chromium: the lab's page; ffmpeg: videos). Does
# nothing when all is there.
# With --sweeps: Snakemake into .env/sweeps, for scripts/sweep; with --slurm: the Debian packages of a Slurm of one's own as well, for its test.
# With --docs: nothing but what builds the documentation, into .env/docs (scripts/docs.sh calls it).
set -euo pipefail
cd "$(dirname "$0")/.."

# An environment of the project's own for Python packages of pinned versions: python_tools FOLDER REQUIREMENTS.
python_tools() {
  cmp -s "$2" "$1/requirements.installed" && return
  echo "setup: installing the Python tools of $2 into $1" >&2
  [ -x "$1/bin/python" ] || python3 -m venv "$1"
  "$1/bin/python" -m pip install --quiet -r "$2" || {
    echo "setup: pip could not install $2" >&2
    exit 1
  }
  cp "$2" "$1/requirements.installed"
}

packages=(g++ clang cmake ninja-build ccache python3 python3-dev python3-pip python3-venv pkg-config libglm-dev libopenimageio-dev openimageio-tools
  libtbb-dev libcli11-dev nlohmann-json3-dev libgtest-dev libgmock-dev libembree-dev gappa assimp-testmodels clang-format clang-tidy
  libclang-rt-14-dev python3-clang-14 verilator make tcl unzip zlib1g-dev)
# Without these the program works and their tests are skipped.
if [ "${1:-}" = --tools ]; then packages+=(chromium ffmpeg); fi
if [ "${1:-}" = --docs ] || [ "${1:-}" = --sweeps ]; then packages=(git python3 python3-venv); fi
if [ "${1:-}" = --slurm ]; then packages=(git python3 python3-venv slurm-wlm munge); fi

missing=()
for package in "${packages[@]}"; do
  grep -q 'ok installed' <<<"$(dpkg-query -W -f='${Status}' "$package" 2>/dev/null)" || missing+=("$package")
done
if ((${#missing[@]})); then
  sudo=""
  if [ "$(id -u)" != 0 ]; then sudo="sudo"; fi
  line="apt-get install -y --no-install-recommends ${missing[*]}"
  if [ -n "$sudo" ] && ! sudo -n true 2>/dev/null; then
    echo "setup: missing packages and no root. Run:  sudo $line" >&2
    exit 1
  fi
  echo "setup: installing ${missing[*]}" >&2
  if ! { $sudo apt-get update -qq && DEBIAN_FRONTEND=noninteractive $sudo $line -qq; } >/tmp/retrace-setup-$$.log 2>&1; then
    tail -20 /tmp/retrace-setup-$$.log >&2
    echo "setup: apt-get failed. The line was: $line" >&2
    exit 1
  fi
  rm -f /tmp/retrace-setup-$$.log
fi

if [ "${1:-}" = --docs ]; then
  python_tools .env/docs scripts/docs/requirements.txt
  exit
fi

if [ "${1:-}" = --sweeps ] || [ "${1:-}" = --slurm ]; then
  python_tools .env/sweeps scripts/sweeps/requirements.txt
  exit
fi

# ap_types: a vendor installation if one is named, otherwise the Apache-2.0 headers inside the hls4ml wheel. The same wheel has ac_types
# (Apache-2.0), on which a test runs the kernels as well.
if [ -z "${RETRACE_AP_TYPES:-}${XILINX_HLS:-}" ] && { [ ! -f .env/ap_types/ap_int.h ] || [ ! -f .env/ac_types/ac_int.h ]; }; then
  echo "setup: fetching ap_types (wheel hls4ml 1.3.0)" >&2
  rm -rf .env/ap_types.tmp
  mkdir -p .env/ap_types.tmp
  python3 -m pip download --quiet --no-deps --require-hashes -r scripts/ap_types.txt -d .env/ap_types.tmp || {
    echo "setup: cannot download the wheel in scripts/ap_types.txt; name a folder with ap_int.h in RETRACE_AP_TYPES instead" >&2
    exit 1
  }
  unzip -q .env/ap_types.tmp/hls4ml-*.whl 'hls4ml/templates/vivado/ap_types/*' 'hls4ml/templates/catapult/ac_types/include/ac_int.h' -d .env/ap_types.tmp
  # The wheel's stream header has an unclear licence; the project has its own (testbench/csim).
  rm -f .env/ap_types.tmp/hls4ml/templates/vivado/ap_types/hls_stream.h
  rm -rf .env/ap_types .env/ac_types
  mv .env/ap_types.tmp/hls4ml/templates/catapult/ac_types/include .env/ac_types
  mv .env/ap_types.tmp/hls4ml/templates/vivado/ap_types .env/ap_types
  rm -rf .env/ap_types.tmp
fi

# Python tools: Yosys with its slang frontend and codespell (lint), PeakRDL (registers).
# LiteX and its libraries, which have releases that fit each other: DRAM controllers and network of the boards.
if [ "${1:-}" = --tools ]; then
  python_tools .env/py scripts/requirements.txt
  python_tools .env/litex scripts/boards/requirements.txt
fi
