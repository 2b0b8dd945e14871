#!/bin/bash
# Usage: apt_repository.sh FOLDER: makes the repository of systemd/README.md from the packages in FOLDER, by the commands
# of that page, and installs nothing: apt finds the packages, gets them whole, and refuses changed ones. No root needed.
set -euo pipefail
packages=$1
work=$(mktemp -d)
trap 'gpgconf --homedir "$GNUPGHOME" --kill gpg-agent; rm -rf "$work"' EXIT
export GNUPGHOME=$work/keys
mkdir -m 700 "$GNUPGHOME"
page=$(dirname "$0")/../../systemd/README.md
fail() {
  echo "$*"
  exit 1
}
gpg --batch --quiet --passphrase '' --quick-generate-key "rig packages <packages@rig.example>" default default never

# The commands of the page, with the folder of this test in place of /srv/apt.
mkdir "$work/apt"
cp "$packages"/*.deb "$work/apt"
commands=$(sed -n '/^    cd \/srv\/apt/,/^$/p' "$page")
[ "$(wc -l <<<"$commands")" -ge 4 ] || fail "systemd/README.md does not say how a repository is made"
bash -euo pipefail -c "${commands//\/srv\/apt/$work/apt}"

# An apt of its own: its sources, lists and keys are in the scratch folder.
mkdir -p "$work"/root/{etc/apt/{sources.list.d,preferences.d},state/lists/partial,cache/archives/partial}
touch "$work/root/status"
apt=(-o Dir::Etc="$work/root/etc/apt" -o Dir::State="$work/root/state" -o Dir::Cache="$work/root/cache"
  -o Dir::State::status="$work/root/status" -o APT::Sandbox::User=root -q)
echo "deb [signed-by=$work/apt/rig-packages.gpg] file:$work/apt ./" >"$work/root/etc/apt/sources.list.d/rig.list"
apt-get "${apt[@]}" update >"$work/said" 2>&1 || fail "$(cat "$work/said")"
! grep -E '^(W|E):' "$work/said" || fail "apt does not take the repository as it is"
mkdir "$work/got"
for file in "$packages"/*.deb; do
  name=$(dpkg-deb --field "$file" Package)
  (cd "$work/got" && apt-get "${apt[@]}" download "$name") >"$work/said" 2>&1 || fail "$(cat "$work/said")"
  cmp "$work/got/$name"_*.deb "$file" || fail "apt gives another $name"
done

# A list of packages that nobody signed is refused.
sed -i 's/^Description:/&  changed/' "$work/apt/Packages"
rm -f "$work/apt"/Packages.*
rm -rf "$work"/root/state/lists/*
mkdir -p "$work/root/state/lists/partial"
apt-get "${apt[@]}" update >"$work/said" 2>&1 || true
grep -Eq '^E:.*(Hash Sum mismatch|unexpected size)' "$work/said" || fail "apt took a list that nobody signed: $(cat "$work/said")"
