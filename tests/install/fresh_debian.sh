#!/bin/bash
# The promise of README.md on a machine that has nothing: a minimal Debian 12 made by debootstrap, a
# clone of this project's last commit in it, and there the two commands, as a user who may sudo.
# No ctest: it fetches half a gigabyte and builds everything without a cache.
#
# Usage (as root): fresh_debian.sh FOLDER [COMMAND]
#   FOLDER   to make the tree in, outside the project; used again when it is there
#   COMMAND  default: ./check
set -euo pipefail
[ $# -ge 1 ] && [ "$(id -u)" = 0 ] || { sed -n '2,9s/^# \?//p' "$0" && exit 2; }
project=$(cd "$(dirname "$0")/../.." && pwd)
tree=$(mkdir -p "$1" && cd "$1" && pwd)/debian
command=${2:-./check}

# shellcheck source=tests/install/minimal_debian.sh
source "$project/tests/install/minimal_debian.sh"

began=$(date +%s)
lap() { echo "-- $1: $(($(date +%s) - began)) s" && began=$(date +%s); }

if [ ! -e "$tree/etc/debian_version" ]; then
  minimal_debian "$tree" sudo,ca-certificates "$1/debootstrap.log"
  chroot "$tree" useradd --create-home --shell /bin/bash tester
  echo 'tester ALL=(ALL) NOPASSWD: ALL' >"$tree/etc/sudoers.d/tester"
  lap "a minimal Debian"
fi
cp -L /etc/resolv.conf "$tree/etc/resolv.conf"

rm -rf "$tree/home/tester/shakerd"
git clone -q --no-hardlinks "$project" "$tree/home/tester/shakerd"
chroot "$tree" chown -R tester: /home/tester/shakerd
lap "a clone of $(git -C "$project" log -1 --format='%h %s')"

# A mount namespace of its own: nothing stays mounted, however this ends.
# shellcheck disable=SC2016  # expanded by the inner shell
inside() {
  unshare --mount --propagation private bash -c '
    mount -t proc proc "$0/proc" && mount --rbind /sys "$0/sys" && mount --rbind /dev "$0/dev" &&
      mount -t tmpfs tmpfs "$0/dev/shm" && exec chroot "$0" runuser -u tester -- bash -lc "$1"' "$tree" "$1"
}
inside "cd ~/shakerd && .ci/setup"
lap "set-up"
status=0
inside "cd / && ~/shakerd/$command" || status=$?
lap "$command ended with status $status"
exit "$status"
