#!/usr/bin/env bash
# Format of the C++ (of every file git knows), syntax of the shell scripts, spelling and style of the prose (scripts/prose.py), SPDX lines of the RTL, and with --tidy static checks (clang-tidy, .clang-tidy; minutes). RTL: scripts/rtl_lint.sh.
# usage: scripts/lint.sh [--tidy BUILD_FOLDER]
set -euo pipefail
cd "$(dirname "$0")/.."

mapfile -t sources < <(git ls-files '*.cpp' '*.hpp' ':!hls/include/contract*.hpp' ':!golden/contract/contract_records.hpp' ':!*certified_bounds.hpp' ':!hls/shader/isa.hpp' ':!golden/shader/isa.hpp')
clang-format --dry-run -Werror "${sources[@]}"
scripts/prose.py
# A licence in the first line of the hardware, but for what PeakRDL writes; LiteDRAM's is its own.
git ls-files '*.sv' '*.svh' '*.v' ':!rtl/shell/rt_regs*.sv' ':!testbench/sim/dram/generated/*.v' | while read -r file; do
  if [ "$(head -1 "$file")" != "// SPDX-License-Identifier: Apache-2.0" ]; then echo "lint: $file does not start with its SPDX line" >&2; exit 1; fi
done
for script in $(git ls-files '*.sh' .ci/run); do bash -n "$script"; done
if [ "${1:-}" = --tidy ]; then
  mapfile -t units < <(git ls-files 'hls/*.cpp' 'golden/*.cpp' 'testbench/csim/*.cpp' 'testbench/kit/*.cpp' 'testbench/vendor/*_vectors.cpp')
  printf '%s\n' "${units[@]}" | xargs -P "$(nproc)" -n 4 clang-tidy --quiet -p "$2" 2>/dev/null
fi
echo "lint: ${#sources[@]} C++ files are formatted"
