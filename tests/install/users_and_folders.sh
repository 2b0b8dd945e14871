#!/bin/bash
# Usage: users_and_folders.sh STAGE: sysusers and tmpfiles make what the units refer to.
set -euo pipefail
root=$(mktemp -d)
trap 'rm -rf "$root"' EXIT
mkdir -p "$root/etc" "$root/usr/lib/sysusers.d"
cp "$1/usr/lib/sysusers.d/shakerd.conf" "$root/usr/lib/sysusers.d/"
systemd-sysusers --root="$root"
cat "$root/etc/passwd" "$root/etc/group"
user=$(sed -n 's/^User=//p' "$1/usr/lib/systemd/system/shakerd.service")
group=$(sed -n 's/^Group=//p' "$1/usr/lib/systemd/system/shakerd.service")
socket_group=$(sed -n 's/^SocketGroup=//p' "$1/usr/lib/systemd/system/shakerd.socket")
gid=$(awk -F: -v g="$group" '$1 == g { print $3 }' "$root/etc/group")
grep -q "^$user:[^:]*:[0-9]*:$gid:" "$root/etc/passwd"
[ "$socket_group" = "$group" ]
# Gateway and bridge are in the group that may look on, and have that group's socket.
view_group=$(sed -n 's/^SocketGroup=//p' "$1/usr/lib/systemd/system/shakerd-view.socket")
view_gid=$(awk -F: -v g="$view_group" '$1 == g { print $3 }' "$root/etc/group")
for unit in "$1"/usr/lib/systemd/system/shakerd-{gateway,mqtt}.service; do
  [ "$(sed -n 's/^Group=//p' "$unit")" = "$view_group" ]
  grep -q "^$(sed -n 's/^User=//p' "$unit"):[^:]*:[0-9]*:$view_gid:" "$root/etc/passwd"
done
[ "$view_gid" != "$gid" ]
# What copies campaigns reads them as a member of the group to which they belong.
unit=$1/usr/lib/systemd/system/shakerd-push.service
[ "$(sed -n 's/^Group=//p' "$unit")" = "$group" ]
grep -q "^$(sed -n 's/^User=//p' "$unit"):[^:]*:[0-9]*:$gid:" "$root/etc/passwd"

[ "$(id -u)" = 0 ] || { echo "folders are only made as root" && exit 0; }
mkdir -p "$root/usr/lib/tmpfiles.d"
cp "$1/usr/lib/tmpfiles.d/shakerd.conf" "$root/usr/lib/tmpfiles.d/"
systemd-tmpfiles --root="$root" --create shakerd.conf
[ "$(stat -c '%a %g' "$root/var/lib/shakerd")" = "750 $gid" ]
[ "$(stat -c %a "$root/run/shakerd")" = 755 ]
