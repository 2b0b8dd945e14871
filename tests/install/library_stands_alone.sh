#!/bin/bash
# Usage: library_stands_alone.sh STAGE: the examples, which have only the installed library, build and find what
# they look for, with CMake's package and with pkg-config.
set -euo pipefail
stage=$(realpath "$1")
examples=$(realpath "$(dirname "$0")/../../examples")
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

# The installed headers are the public ones and no others.
sed -n 's/^INPUT += //p' "$examples/../cmake/public_headers.txt" | sort >"$work/public"
(cd "$stage/usr/include/shaker" && find . -type f | sed 's|^\./||' | sort) | diff "$work/public" -

cmake -S "$examples" -B "$work" -G Ninja -DCMAKE_PREFIX_PATH="$stage/usr"
nice ninja -C "$work" -j 1  # beside tests that want their time

# expect PATTERN PROGRAM: it prints a line that matches.
expect() {
  "$work/$2" >"$work/said"
  cat "$work/said"
  grep -Eq "$1" "$work/said" || { echo "$2 does not print: $1" && exit 1; }
}
expect '^k = 400\.0000 .*1/s\^2' estimate
expect '^c = 4\.0000 ' estimate
expect '^k = 400\.[0-9]+, from 39[0-9]\.[0-9]+ to 40[0-9]\.[0-9]+ 1/s\^2' estimate_runs
expect '^a warning: 1 sample lies further .* run 1 sample 21' estimate_runs
expect '^k = (300\.0|299\.9)' new_effect
expect '^length = 0\.1000 ' new_effect
expect '^cycle 20:  k = (400\.[0-2]|399\.[89])' online
expect '^explained' diagnose
expect '^cubic_stiffness, probability (0\.9|1\.0)' diagnose

packages=$(dirname "$(find "$stage/usr" -name shaker-estimator.pc)")
by_pkg_config() {  # EXAMPLE PACKAGE
  # shellcheck disable=SC2046  # one word for each flag
  c++ "$examples/$1.cpp" -o "$work/by_pkg_config" $(PKG_CONFIG_PATH=$packages pkg-config --cflags --libs "$2")
}
by_pkg_config estimate shaker-estimator
expect '^k = 400\.0000' by_pkg_config
by_pkg_config estimate_runs shaker-estimate
expect '^k = 400\.[0-9]+, from' by_pkg_config
by_pkg_config diagnose shaker-diagnosis
expect '^cubic_stiffness, probability' by_pkg_config
