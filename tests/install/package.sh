#!/bin/bash
# Usage: package.sh BUILD FOLDER: makes the Debian packages and looks into them. They stay in FOLDER,
# where the virtual rig PC installs shakerd.deb with dpkg.
set -euo pipefail
build=$1 folder=$2
rm -rf "$folder"
mkdir -p "$folder"
(cd "$folder" && cpack -G DEB --config "$build/CPackConfig.cmake" -B "$folder") >"$folder/cpack.log" 2>&1 || {
  tail -n 30 "$folder/cpack.log"
  exit 1
}
rm -rf "$folder/_CPack_Packages"
package=$folder/shakerd.deb
mv "$folder"/shakerd_*.deb "$package"
dpkg-deb --info "$package"
dpkg-deb --contents "$package" | awk '{ print $1, $2, $6 }' | tee "$folder/contents"

fail() {
  echo "$*"
  exit 1
}
for file in usr/bin/{shakerd,shakerctl,oleosim,shakerd-stop-exciter,shakerd-gateway,shakerd-mqtt} usr/libexec/shakerd/shakerctl-{analysis,diagnosis,push} usr/lib/systemd/system/shakerd{,@}.service \
  usr/lib/systemd/system/shakerd-{view{,@}.socket,gateway{,@}.socket,{gateway,mqtt,push}{,@}.service,push{,@}.timer} usr/share/doc/shakerd/{LICENSE.uPlot,bridges.md} usr/share/shakerd/grafana-dashboard.json \
  usr/lib/systemd/system/shakerd{,@}.socket usr/lib/sysusers.d/shakerd.conf \
  usr/lib/tmpfiles.d/shakerd.conf etc/shakerd/rig.json \
  usr/share/man/man1/{shakerctl,shakerctl-{run,estimate,campaigns},oleosim}.1.gz \
  usr/share/man/man8/{shakerd,shakerd-stop-exciter,shakerd-gateway,shakerd-mqtt}.8.gz usr/share/bash-completion/completions/shakerctl \
  usr/share/zsh/vendor-completions/_shakerctl usr/share/fish/vendor_completions.d/shakerctl.fish; do
  grep -q " \./$file$" "$folder/contents" || fail "the package lacks /$file"
done
! grep -v ' root/root ' "$folder/contents" || fail "these files are not root's"
depends=$(dpkg-deb --field "$package" Depends)
for library in libc6 libstdc++6 libmicrohttpd12 libmodbus5 libmosquitto1 libpq5 libsqlite3-0 libsystemd0; do
  grep -q "\b$library\b" <<<"${depends//+/+}" || fail "Depends lacks $library: $depends"
done
dpkg-deb --ctrl-tarfile "$package" | tar -xO ./conffiles | grep -qx /etc/shakerd/rig.json ||
  fail "rig.json is not a conffile: an upgrade would overwrite it"
for script in postinst prerm postrm; do
  dpkg-deb --ctrl-tarfile "$package" | tar -xO "./$script" | sh -n || fail "$script is no shell script"
done

# The clients in Python, for any architecture.
python=$folder/python3-shakerd.deb
mv "$folder"/python3-shakerd_*_all.deb "$python"
dpkg-deb --info "$python"
dpkg-deb --extract "$python" "$folder/python"
PYTHONDONTWRITEBYTECODE=1 PYTHONPATH=$folder/python/usr/lib/python3/dist-packages python3 - "$folder" <<'END'
import sys

import shakerd

assert shakerd.__file__.startswith(sys.argv[1]), shakerd.__file__
assert shakerd.connect and shakerd.open_campaign and shakerd.diagnose
END
[ -e "$folder/python/usr/lib/python3/dist-packages/shakerd/py.typed" ] || fail "py.typed is missing"
! grep -q "python3/dist-packages" "$folder/contents" || fail "the Python package is in shakerd's as well"
for script in postinst prerm; do
  dpkg-deb --ctrl-tarfile "$python" | tar -xO "./$script" | sh -n || fail "$script is no shell script"
done
