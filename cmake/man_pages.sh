#!/bin/bash
# Usage: man_pages.sh BIN FOLDER VERSION: makes the manual pages of the programs in BIN from what they
# print with --help. help2man does the work. shakerctl has a page for each of its commands.
set -euo pipefail
bin=$(realpath "$1") folder=$2 version=$3
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
rm -rf "$folder"
mkdir -p "$folder"
export SOURCE_DATE_EPOCH=${SOURCE_DATE_EPOCH:-$(stat -c %Y "$bin/shakerd")} LC_ALL=C.UTF-8

# help PROGRAM [COMMAND]: as help2man wants it: "-h, --help", one line for an option and its value.
help() {
  # By its name alone: the usage line shows how a program was called.
  (PATH=$bin:$PATH && "$@" --help) |
    sed -E -e 's/^  -([a-z]),--/  -\1, --/' -e 's/^Subcommands:/Commands:/' -e 's/^Positionals:/Arguments:/' \
      -e 's/^(  --[a-z-]+ [^ ]+) ([A-Z][a-z]+ [a-z])/\1  \2/' -e 's/^Exit status: */*Exit Status*\n/'
}

# page SECTION "WHAT IT IS" PROGRAM [COMMAND]
page() {
  local section=$1 what=$2
  shift 2
  local name="${*// /-}"
  name=${name// /-}
  help "$@" >"$work/$name.help"
  # help2man calls a program; this one prints what was made of the help.
  cat >"$work/$name" <<END
#!/bin/sh
case \$1 in --version) echo "$name $version" ;; *) cat "\$0.help" ;; esac
END
  chmod +x "$work/$name"
  {
    echo '[see also]'
    echo "The complete documentation is in /usr/share/doc/shakerd."
    echo ".PP"
    for other in "${pages[@]}"; do
      [ "$other" = "$name($section)" ] || echo ".BR ${other%(*} (${other##*(},"
    done | sed '$s/,$//'
  } >"$work/include"
  help2man --no-info --section="$section" --name="$what" --source="shakerd $version" --manual=shakerd \
    --include="$work/include" --output="$folder/$name.$section" "$work/$name"
  gzip -9n "$folder/$name.$section"
}

pages=("shakerd(8)" "shakerctl(1)" "oleosim(1)" "shakerd-stop-exciter(8)" "shakerd-gateway(8)" "shakerd-mqtt(8)")
page 8 "drives a shaker rig and estimates the damper on it" shakerd
page 8 "shows a shaker rig to browsers on this PC" shakerd-gateway
page 8 "publishes a shaker rig to an MQTT broker" shakerd-mqtt
page 8 "stops the exciter of a rig at once" shakerd-stop-exciter
page 1 "a virtual shaker rig with a damper" oleosim
page 1 "operates shakerd, and estimates from files" shakerctl
# "  name    what it does"
sed -n '/^Commands:/,/^$/p' "$work/shakerctl.help" >"$work/commands"
while read -r command what; do
  pages=("shakerctl(1)" "shakerd(8)")
  page 1 "${what,}" shakerctl "$command"
done < <(sed 1d "$work/commands" | grep '^  [a-z]')
