#!/bin/bash
# Usage: units_are_valid.sh STAGE: systemd itself finds nothing wrong with the installed units.
set -euo pipefail
stage=$(realpath "$1")
units=$(mktemp -d)
trap 'rm -rf "$units"' EXIT
cp "$stage"/usr/lib/systemd/system/shakerd* "$units/"
# The programs stand under the stage, not under /usr.
sed -i -E "s#^(Exec[A-Za-z]*=)/usr/bin/#\1$stage/usr/bin/#" "$units"/shakerd*.service
said=$(SYSTEMD_UNIT_PATH="$units:" systemd-analyze verify --man=no \
  "$units"/shakerd*.service "$units"/shakerd*.socket "$units"/shakerd*.timer 2>&1) || { echo "$said" && exit 1; }
# verify only warns of a key that it does not know.
if grep shakerd <<<"$said"; then
  exit 1
fi
echo "valid"
