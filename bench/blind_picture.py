#!/usr/bin/python3
"""Draws docs/blind_suite.svg from the tables of the blind suite:

    build/bench/blind_suite --threads 2 --output tables.md
    bench/blind_picture.py tables.md docs/blind_suite.svg
"""
import html
import pathlib
import re
import sys

TITLE = "Campaigns of each effect by what the diagnosis said"
PARTS = (("named first", "#2b6cb0"), ("in the set", "#90cdf4"), ("seen, not in the set", "#ecc94b"),
         ("not seen", "#e2e8f0"))
LEFT, WIDE, TOP, ROW = 250, 400, 30, 15  # of the bars


def effects(text):
    """Name and the shares of PARTS, from the lines "| name | seen / all | first / seen | in set / seen | ..."."""
    for line in text.splitlines():
        counts = re.fullmatch(r"\| (\S.*?) \| (\d+) / (\d+) \| (\d+) / \d+ \| (\d+) / \d+ \| \d+ / \d+ \|", line)
        if counts:
            seen, all_, first, in_set = map(int, counts.groups()[1:])
            yield counts[1], [n / all_ for n in (first, in_set - first, seen - in_set, all_ - seen)]


def picture(text):
    rows = list(effects(text))
    bottom = TOP + ROW * len(rows)
    lines = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 680 {bottom + 30}" font-family="sans-serif" '
             'font-size="11">', f'<title>{TITLE}</title><rect width="100%" height="100%" fill="#fff"/>']
    for x, (name, colour) in zip((10, 126.5, 236.5, 411.5), PARTS):
        lines.append(f'<rect x="{x}" y="8" width="12" height="12" fill="{colour}" stroke="#666"/>'
                     f'<text x="{x + 17}" y="18">{name}</text>')
    for row, (name, shares) in enumerate(rows):
        y, x = TOP + 1 + ROW * row, LEFT
        lines.append(f'<text x="{LEFT - 6}" y="{y + 10}" text-anchor="end">{html.escape(name)}</text>')
        for share, (_, colour) in zip(shares, PARTS):
            if share > 0:
                lines.append(f'<rect x="{x:.1f}" y="{y}" width="{WIDE * share:.1f}" height="12" fill="{colour}"/>')
            x += WIDE * share
    for percent in range(0, 101, 25):
        x = LEFT + WIDE * percent / 100
        lines.append(f'<path d="M{x:.1f} {TOP}V{bottom}" stroke="#999" stroke-width=".5"/>'
                     f'<text x="{x:.1f}" y="{bottom + 14}" text-anchor="middle">{percent} %</text>')
    return "\n".join(lines + ["</svg>", ""])


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    pathlib.Path(sys.argv[2]).write_text(picture(pathlib.Path(sys.argv[1]).read_text()))
