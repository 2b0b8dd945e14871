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

# The best of x86-64-v4 and x86-64-v3 that this PC has, as the C library's loader finds it; else "all".
own_instruction_set() {
  local best
  best=$(/lib64/ld-linux-x86-64.so.2 --help 2>/dev/null | sed -n 's/^ *\(x86-64-v[34]\) (supported.*/\1/p' | head -n 1)
  echo "${best:-all}"
}

# ThreadSanitizer of g++ 12 cannot live with the address randomisation of newer kernels.
# shellcheck disable=SC2034  # for who sources this
fixed_addresses=()
# shellcheck disable=SC2034
if setarch "$(uname -m)" -R true 2>/dev/null; then fixed_addresses=(setarch "$(uname -m)" -R); fi

# show_progress WHAT [BEGAN]: reads what ninja or ctest says and shows how far it is and how long it still
# takes: one moving line on a terminal, a line every 30 s elsewhere. A first guess: it takes all
# steps for equally long. BEGAN: $SECONDS when the first step began, where that was before.
show_progress() {
  local what=$1 began=${2:-$SECONDS} shown=$SECONDS line at=0 of=0 gone left text moving=no status
  if [ -t 1 ]; then moving=yes; fi
  while true; do
    line='' status=0
    IFS= read -r -t 1 line || status=$?
    if [ $status != 0 ] && [ $status -le 128 ]; then break; fi  # above 128: nothing within a second
    if [[ $line =~ ^\[?\ *([0-9]+)/([0-9]+)[]\ ] ]]; then
      at=${BASH_REMATCH[1]} of=${BASH_REMATCH[2]}
    fi
    gone=$((SECONDS - began))
    if [ "$at" = 0 ] || { [ $moving = no ] && [ $((SECONDS - shown)) -lt 30 ]; }; then continue; fi
    shown=$SECONDS
    left=$((gone * (of - at) / at))
    text=$(printf '%s: %d of %d in %d:%02d min, about %d:%02d min left' "$what" "$at" "$of" \
      $((gone / 60)) $((gone % 60)) $((left / 60)) $((left % 60)))
    if [ $moving = yes ]; then printf '\r%s\033[K' "$text"; else say "$text"; fi
  done
  if [ $moving = yes ]; then printf '\r\033[K'; fi
}

seconds_since() { printf '%d s' $(($(date +%s) - $1)); }
