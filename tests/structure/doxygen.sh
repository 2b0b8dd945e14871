#!/bin/bash
# Usage: doxygen.sh ROOT BUILD: Doxygen writes the public headers' pages into BUILD/doxygen without a warning.
set -euo pipefail
if ! command -v doxygen >/dev/null; then
  echo "Skipped: doxygen is not installed (apt-get install doxygen)."
  exit 77
fi
cd "$1"
rm -rf "$2/doxygen"
{ cat docs/Doxyfile && echo "OUTPUT_DIRECTORY = \"$2\""; } | doxygen -
grep -q 'OnlineEstimator' "$2/doxygen/annotated.html" || { echo "the pages lack the headers' classes" && exit 1; }
