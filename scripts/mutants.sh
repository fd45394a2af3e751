#!/usr/bin/env bash
# Breaks one rule of the RTL at a time (a rounding, a tie, a handshake) and shows which test notices. Exit code 1 if a mutant survives.
# Usage: scripts/mutants.sh [--build build/release] [--only TEXT] [--list]      --core: the whole core; it needs a build with the configurations `small` and `saarcor`
set -euo pipefail
cd "$(dirname "$0")/.."
exec python3 scripts/mutants.py "$@"
