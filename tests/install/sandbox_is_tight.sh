#!/bin/bash
# Usage: sandbox_is_tight.sh STAGE: holds the unit's exposure to 1.4, with a drop-in to 1.6, and those of
# gateway, bridge and push to 1.3.
set -euo pipefail
stage=$1
units=$(mktemp -d)
trap 'rm -rf "$units"' EXIT

exposure() {  # LIMIT UNIT [DROP-IN]: LIMIT in tenths
  local name=$2${3:+-${3%.conf}}.service
  cp "$stage/usr/lib/systemd/system/$2.service" "$units/$name"
  if [ -n "${3:-}" ]; then
    cat "$stage/usr/share/shakerd/drop-ins/$3" >>"$units/$name"
  fi
  said=$(systemd-analyze security --offline=yes --threshold="$1" "$units/$name" 2>&1) || {
    grep -v ✓ <<<"$said"
    exit 1
  }
  tail -n 1 <<<"$said"
}
exposure 14 shakerd
exposure 14 shakerd@
exposure 16 shakerd realtime.conf
exposure 16 shakerd serial-port.conf
exposure 13 shakerd-gateway
exposure 13 shakerd-mqtt
exposure 13 shakerd-push
exposure 13 shakerd-push@
exposure 13 shakerd-gateway@
exposure 13 shakerd-mqtt@
