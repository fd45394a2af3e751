#!/usr/bin/env bash
# Writes the HLS package: kernels, generated types, testbenches with their data, configuration of the vendor's tools, constraints, register map.
# usage: scripts/export_hls.sh --output DIR
# DIR becomes the package, with DIR/retrace-hls.tar.gz, the same packed (top folder retrace-hls, the same bytes for the same sources). DIR must not
# exist, or be empty, or hold an earlier package in which nothing was added or changed, which is replaced. It appears whole or not at all.
set -euo pipefail
root=$(cd "$(dirname "$0")/.." && pwd)
archive=retrace-hls.tar.gz
fail() {
  echo "export_hls: $*" >&2
  exit 1
}
usage() { sed -n '3,5s/^# //p' "$0" >&2; }

output=
while (($#)); do
  case $1 in
    --output) [ -n "${2:-}" ] || { echo "export_hls: --output needs a folder" >&2; exit 2; }; output=$2; shift 2 ;;
    -h | --help) usage; exit 0 ;;
    *) echo "export_hls: unknown option '$1'" >&2; usage; exit 2 ;;
  esac
done
[ -n "$output" ] || { usage; exit 2; }
output=$(realpath -m "$output")
parent=$(dirname "$output")
[ -d "$parent" ] || fail "there is no folder '$parent' to write into"
[ -w "$parent" ] || fail "cannot write into '$parent'"

# An earlier package may be replaced, anything else not: every file must be one of its list, unchanged.
if [ -e "$output" ]; then
  [ -d "$output" ] || fail "'$output' is a file"
  first=$(find "$output" -mindepth 1 -print -quit)
  if [ -n "$first" ]; then
    [ -f "$output/SHA256SUMS" ] || fail "'$output' is not empty and not a package ('$first')"
    listed=$(cut -c67- "$output/SHA256SUMS")
    while IFS= read -r file; do
      name=${file#"$output"/}
      case $name in SHA256SUMS | $archive) continue ;; esac
      grep -qxF -- "$name" <<<"$listed" || fail "'$output' holds '$name', which no package does; remove it or choose another folder"
    done < <(find "$output" -mindepth 1 ! -type d)
    changed=$(cd "$output" && LC_ALL=C sha256sum --check --quiet SHA256SUMS 2>/dev/null | head -1) || true
    [ -z "$changed" ] || fail "'$output' was changed (${changed}); remove it or choose another folder"
  fi
fi

work=$(mktemp -d "$parent/.retrace-hls.XXXXXX")
finish() { # an earlier package that was moved away comes back if the new one has not taken its place
  if [ -d "$work/replaced" ] && [ ! -e "$output" ]; then mv "$work/replaced" "$output"; fi
  rm -rf "$work"
}
trap finish EXIT
trap 'exit 1' INT TERM HUP
package=$work/retrace-hls
version=$(sed -nE 's/^project\(retrace VERSION ([0-9.]+).*/\1/p' "$root/CMakeLists.txt")
[ -n "$version" ] || fail "no version in CMakeLists.txt"
stages=(ray_setup kd_descend leaf_exit kd_backtrack tri_test hit_finish instance_enter)

copy() { # copy FOLDER_IN_PACKAGE FILE...
  local folder=$package/$1 file
  shift
  mkdir -p "$folder"
  for file in "$@"; do
    [ -f "$file" ] || fail "there is no '$file'"
    cp "$file" "$folder/"
  done
}
cd "$root"
copy . LICENSE scripts/export/Makefile scripts/export/vitis_hls.tcl scripts/export/vivado_ooc.tcl docs/hls-export.md
sed "s/@VERSION@/$version/" scripts/export/README.md >"$package/README.md"
copy hls/include hls/include/*.hpp
copy hls/stages hls/stages/*.hpp hls/stages/*.cpp
copy hls/top hls/top/*.hpp hls/top/*.cpp
copy hls/ring hls/ring/*.hpp hls/ring/*.cpp
copy hls/streaming hls/streaming/*.hpp hls/streaming/*.cpp
copy testbench/csim testbench/csim/ring_run.hpp testbench/csim/ring_region.cpp
copy testbench/csim/include testbench/csim/include/hls_stream.h testbench/csim/include/hls_tasks.h
copy testbench/vendor testbench/vendor/*_bench.hpp testbench/vendor/tb_*.cpp
copy testbench/vendor/data testbench/vendor/data/*.inc
copy host testbench/vendor/host/retrace_kernel.h golden/contract/contract_records.hpp
# The package has the host's folder at its top.
sed 's|"\.\./data/|"../testbench/vendor/data/|' testbench/vendor/host/retrace_xrt.cpp >"$package/host/retrace_xrt.cpp"
copy constraints constraints/zynq-xczu3eg.xdc constraints/alveo-xcu50.xdc

config() { # config NAME TOP FUNCTION PART CLOCK FLOW FORMAT WHAT
  cat >"$package/$1.cfg" <<END
# $8
# vitis-run --mode hls --csim|--cosim|--package --config $1.cfg --work_dir build/$2; v++ -c --mode hls with the same options synthesizes.
part=$4

[hls]
flow_target=$6
clock=$5
clock_uncertainty=15%
syn.top=$3
syn.file=hls/$([ "$2" = trace ] && echo top || echo stages)/$2.cpp
syn.cflags=-std=c++17
$([ "$2" = trace ] && echo "syn.interface.m_axi_addr64=1")
tb.file=testbench/vendor/tb_$2.cpp
tb.cflags=-std=c++17
csim.clean=1
cosim.rtl=verilog
package.output.format=$7
package.output.syn=0
package.ip.vendor=retrace
package.ip.library=hls
package.ip.name=retrace_$2
package.ip.version=${version%.*}
package.ip.display_name=Retrace $2
END
  sed -i '/^$/{N;/^\n$/D}; /^syn.cflags/{n;/^$/d}' "$package/$1.cfg"
}
config hls_config trace retrace_trace xczu3eg-sbva484-1-e 5ns vivado ip_catalog "The full kernel as an IP for a Zynq UltraScale+."
config hls_config_trace_xo trace retrace_trace xcu50-fsvh2104-2-e 3.333ns vitis xo "The full kernel as a .xo for v++ --link on an Alveo U50."
for stage in "${stages[@]}"; do
  config "hls_config_$stage" "$stage" "${stage}_top" xczu3eg-sbva484-1-e 5ns vivado ip_catalog "The stage $stage as an IP for a Zynq UltraScale+."
done

find "$package" -type d -exec chmod 755 {} +
find "$package" -type f -exec chmod 644 {} +
(cd "$package" && find . -type f -printf '%P\n' | LC_ALL=C sort | xargs -d '\n' sha256sum >"$work/SHA256SUMS")
mv "$work/SHA256SUMS" "$package/SHA256SUMS"
chmod 644 "$package/SHA256SUMS"
tar --create --format=ustar --sort=name --mtime='2000-01-01 00:00:00 UTC' --owner=0 --group=0 --numeric-owner -C "$work" retrace-hls \
  | gzip --no-name -9 >"$work/$archive"
chmod 644 "$work/$archive"
mv "$work/$archive" "$package/$archive"

if [ -d "$output" ]; then mv "$output" "$work/replaced"; fi
mv "$package" "$output"
echo "export_hls: $output: $(grep -c . "$output/SHA256SUMS") files, $archive sha256 $(sha256sum "$output/$archive" | cut -c1-64)"
