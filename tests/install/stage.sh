#!/bin/bash
# Usage: stage.sh BUILD STAGE: installs the build under the folder STAGE as if that were /.
set -euo pipefail
rm -rf "$2"
DESTDIR=$2 cmake --install "$1" --prefix /usr --strip >"$2.log" 2>&1 || { cat "$2.log" && exit 1; }
for file in usr/lib/systemd/system/shakerd{,@}.{service,socket} \
  usr/lib/systemd/system/shakerd-{view{,@}.socket,{gateway,mqtt,push}{,@}.service,gateway{,@}.socket,push{,@}.timer} usr/lib/sysusers.d/shakerd.conf \
  usr/lib/tmpfiles.d/shakerd.conf usr/lib/systemd/network/80-can0.network; do
  [ -s "$2/$file" ] || { echo "$file was not installed" && exit 1; }
done
if grep -rn '@[a-z]*@' "$2/usr/lib/systemd"; then
  echo "a unit still holds a placeholder" && exit 1
fi
# An editor finds the schema that a file names.
source=$(cd "$(dirname "$0")/../.." && pwd)
for file in "$2"/usr/share/shakerd/examples/*.json "$2"/etc/shakerd/*.json; do
  # shellcheck disable=SC2016  # a key of JSON
  named=$(sed -n 's/^ *"$schema": "\(.*\)",$/\1/p' "$file")
  case $named in
    /*) schema=$2$named ;;
    *) schema=$(dirname "$file")/$named ;;
  esac
  cmp "$schema" "$source/config/schema/${named##*/}" || { echo "$file names $named" && exit 1; }
done
for schema in "$source"/protocol/schema/*.json; do
  cmp "$schema" "$2/usr/share/shakerd/schema/stream/${schema##*/}"
done
# Installing again must not replace the rig file that an operator has changed.
echo '// changed by hand' >>"$2/etc/shakerd/rig.json"
DESTDIR=$2 cmake --install "$1" --prefix /usr --strip >>"$2.log" 2>&1
tail -n 1 "$2/etc/shakerd/rig.json" | grep -q 'changed by hand'
