# Sourced by .ci/setup, ./check and ./demo: plain lines, one-sentence failures, and a clone whose
# files stay its owner's, whoever runs the script. Sets `root`, the project's folder.
# shellcheck shell=bash
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)

say() { printf '%s\n' "$*"; }
fail() {
  printf '%s: %s\n' "$(basename "$0")" "$*" >&2
  exit 1
}

# Run as root (or through sudo) in somebody's clone, a build folder would become root's, and the
# next run without root could not write it. Call it from an EXIT trap.
hand_back() {
  if [ "$(id -u)" = 0 ] && [ -e "$1" ]; then
    chown -R --no-dereference --reference="$root" "$1"
  fi
}

need_writable() {  # FOLDER: made by us or to be made by us
  mkdir -p "$1" 2>/dev/null || fail "cannot create $1; give $(id -un) write access to the clone."
  if [ ! -w "$1" ] || { [ -e "$1/CMakeCache.txt" ] && [ ! -w "$1/CMakeCache.txt" ]; }; then
    fail "$1 belongs to $(stat -c %U "$1"), not to $(id -un); remove it (sudo rm -r $1) and run again."
  fi
}

# As many compilers as there are cores, and 1.5 GB of free memory for each.
jobs_that_fit() {
  awk -v cores="$(nproc)" '/MemAvailable/ {
    fit = int($2 / 1500000); if (fit > cores) fit = cores; if (fit < 1) fit = 1; print fit
  }' /proc/meminfo
}

# Under sudo, HOME may still be the user's, and a cache with root's files in it is of no use to him.
quiet_environment() {
  export PYTHONDONTWRITEBYTECODE=1 LC_ALL=C.UTF-8
  if [ -z "${CCACHE_DIR:-}" ] && [ ! -O "${HOME:-/nonexistent}" ]; then
    export CCACHE_DIR=$root/build/ccache
  fi
}

configure() {  # FOLDER [CMAKE OPTIONS]
  local folder=$1 made_for
  shift
  need_writable "$folder"
  if [ -e "$folder/CMakeCache.txt" ]; then  # a build folder copied along with its clone is stale
    made_for=$(sed -n 's/^CMAKE_HOME_DIRECTORY:INTERNAL=//p' "$folder/CMakeCache.txt")
    [ "$made_for" = "$root" ] || rm -rf "$folder/CMakeCache.txt" "$folder/CMakeFiles"
  fi
  cmake -S "$root" -B "$folder" -G Ninja "$@"
}

seconds_since() { printf '%d s' $(($(date +%s) - $1)); }
