#!/bin/bash
# Usage: sandbox_is_tight.sh STAGE: holds the unit's exposure to 1.4, with a drop-in to 1.6.
set -euo pipefail
stage=$1
units=$(mktemp -d)
trap 'rm -rf "$units"' EXIT

exposure() {  # LIMIT [DROP-IN]: LIMIT in tenths
  local name=shakerd${2:+-${2%.conf}}.service
  cp "$stage/usr/lib/systemd/system/shakerd.service" "$units/$name"
  if [ -n "${2:-}" ]; then
    cat "$stage/usr/share/shakerd/drop-ins/$2" >>"$units/$name"
  fi
  said=$(systemd-analyze security --offline=yes --threshold="$1" "$units/$name" 2>&1) || {
    grep -v ✓ <<<"$said"
    exit 1
  }
  tail -n 1 <<<"$said"
}
exposure 14
exposure 16 realtime.conf
exposure 16 serial-port.conf
