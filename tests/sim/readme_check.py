"""sim/parameters.md lists what `oleosim --help` prints; with --write it is brought up to date."""
import pathlib
import re
import subprocess
import sys

COLUMN = re.compile(r"\s{2,}")


def tables(program):
    text = subprocess.run([program, "--help"], capture_output=True, text=True, check=True).stdout
    text = text.split("Parameters (", 1)[1].split("\nFaults", 1)[0]
    lines = []
    for line in text.splitlines()[1:]:
        if line.startswith("  "):
            cells = COLUMN.split(line.strip().replace("|", r"\|"))
            assert len(cells) == 4, line
            lines.append("| `{}` | {} | {} | {} |".format(*cells))
        elif line:
            lines += ["", f"**{line.rstrip(':')}**", "", "| name | unit | default | meaning |",
                      "|---|---|---|---|"]
    return "\n".join(lines).strip()


def main(program, readme, write):
    path = pathlib.Path(readme)
    text, wanted = path.read_text(), tables(program)
    if write:
        start = text.index("alike.\n") + len("alike.\n")
        path.write_text(f"{text[:start]}\n{wanted}\n")
        return 0
    if wanted.count("\n") < 30 or wanted not in text:
        print(f"{readme}: the parameter tables are out of date; run this with --write")
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1], sys.argv[2], "--write" in sys.argv))
