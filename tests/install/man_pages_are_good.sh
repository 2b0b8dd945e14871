#!/bin/bash
# Usage: man_pages_are_good.sh STAGE: man finds no mistake in the manual pages, each has its sections,
# and each command of shakerctl has one.
set -euo pipefail
export LC_ALL=C.UTF-8 MANWIDTH=100
pages=$1/usr/share/man
for page in "$pages"/man[18]/*.gz; do
  said=$(man --warnings -E UTF-8 -l -Tutf8 "$page" 2>&1 >/dev/null)
  [ -z "$said" ] || { echo "$page: $said" && exit 1; }
  text=$(man -l "$page")
  for section in NAME SYNOPSIS OPTIONS "SEE ALSO"; do
    grep -qx "$section" <<<"$text" || { echo "$page lacks $section" && exit 1; }
  done
done
while read -r command; do
  [ -s "$pages/man1/shakerctl-$command.1.gz" ] || { echo "shakerctl $command has no page" && exit 1; }
done < <("$1/usr/bin/shakerctl" --help | sed -n '/^Subcommands:/,/^$/s/^  \([a-z-]*\) .*/\1/p')
man -l "$pages/man1/shakerctl-run.1.gz" | grep -q -- --quiet
man -l "$pages/man8/shakerd.8.gz" | grep -q "^EXIT STATUS"
echo "$(find "$pages" -name '*.gz' | wc -l) pages"
