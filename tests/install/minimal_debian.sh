# Sourced by what wants a Debian 12 that has nothing; run as root.
# shellcheck shell=bash

# minimal_debian TREE PACKAGES LOG: makes it by debootstrap, with further PACKAGES (comma-separated). The mirrors
# are those of this machine, whatever they are. Nothing that is installed there is started.
minimal_debian() {
  local mirrors mirror
  # shellcheck disable=SC2016  # apt-get fills these in
  mirrors=$(apt-get indextargets 'Created-By: Packages' --format '$(SITE) $(RELEASE) $(COMPONENT)' |
    awk '$2 ~ /^bookworm/' | sort -u)
  mirror=$(awk '$2 == "bookworm" { print $1; exit }' <<<"$mirrors")
  rm -rf "$1"
  debootstrap --variant=minbase --include="$2" bookworm "$1" "$mirror" >"$3"
  awk '{ print "deb", $1, $2, $3 }' <<<"$mirrors" >"$1/etc/apt/sources.list"
  printf '#!/bin/sh\nexit 101\n' >"$1/usr/sbin/policy-rc.d" && chmod 755 "$1/usr/sbin/policy-rc.d"
}
