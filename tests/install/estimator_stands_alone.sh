#!/bin/bash
# Usage: estimator_stands_alone.sh STAGE: a project that has only the installed estimator builds and
# fits with it.
set -euo pipefail
stage=$(realpath "$1")
here=$(cd "$(dirname "$0")" && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cmake -S "$here/consumer" -B "$work" -G Ninja -DCMAKE_PREFIX_PATH="$stage/usr" -DCMAKE_BUILD_TYPE=Release
ninja -C "$work"
"$work/consumer"
