#!/usr/bin/env bash
# Builds the documentation site into out/site. Fails on a page that is in no menu, and on a link, an anchor or a file of the repository that does not exist.
# Installs what it needs, pinned, into .env/docs (scripts/docs/requirements.txt).
# usage: scripts/docs.sh [--serve] [--output DIR]   (--serve: shows it at http://127.0.0.1:8000 and follows changes)
set -euo pipefail
cd "$(dirname "$0")/.."
serve=
output=out/site
while (($#)); do
  case $1 in
    --serve) serve=yes; shift ;;
    --output) [ -n "${2:-}" ] || { echo "docs: --output needs a folder" >&2; exit 2; }; output=$2; shift 2 ;;
    *) echo "docs: unknown option '$1'" >&2; sed -n '4s/^# //p' "$0" >&2; exit 2 ;;
  esac
done
output=$(realpath -m "$output")

scripts/setup.sh --docs
if [ -n "$serve" ]; then exec .env/docs/bin/python -m mkdocs serve --strict -f scripts/docs/mkdocs.yml; fi
# (--quiet would silence the warnings that --strict counts.)
.env/docs/bin/python -m mkdocs build --strict -f scripts/docs/mkdocs.yml --site-dir "$output" 2> >(grep -v "^INFO" >&2)
echo "docs: $(find "$output" -name '*.html' | wc -l) pages in $output"
