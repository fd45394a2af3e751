#!/usr/bin/env bash
# Simulates what synthesis made: the ECP5 netlist of every stage, and of the core, in Verilator with models of the cells. The benches are those
# of the RTL, so a stage's netlist meets the HLS function and the RTL in every bit and clock, and the core's gives csim's hits.
# Usage: scripts/netlist_sim.sh [stage|core|all] [--stage NAME]... [--vectors N] [--seed N] [--mutate KIND:N]...   (--help says more)
set -euo pipefail
cd "$(dirname "$0")/.."
exec python3 scripts/netlist_sim.py "$@"
