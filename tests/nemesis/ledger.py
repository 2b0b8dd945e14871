#!/usr/bin/python3
"""docs/soak: what long runs found, one line of JSON a run, so that runs on the same code add up."""
import datetime
import hashlib
import json
import os
import pathlib
import subprocess

from places import SOURCE

ROOMS = ("daemon", "drivers", "record")
SOURCES = (".cpp", ".hpp")
FOLDER = SOURCE / "docs" / "soak"


def git(*words):
    return subprocess.run(["git", "-C", str(SOURCE), *words], capture_output=True, text=True,
                          check=True).stdout.strip()


def code():
    """{room: an id of its C++ files in HEAD}: the same for the same files, whatever the commit."""
    def of(room):
        files = [line for line in git("ls-tree", "-r", "HEAD", "--", room).splitlines()
                 if line.endswith(SOURCES)]
        return hashlib.sha256("\n".join(files).encode()).hexdigest()[:12]
    return {room: of(room) for room in ROOMS}


def why_not():
    """Why a run may not be counted for this code; empty when it may."""
    changed = git("status", "--porcelain", "--untracked-files=all", "--", *ROOMS).splitlines()
    if [line for line in changed if line.endswith(SOURCES)]:
        return f"files of {', '.join(ROOMS)} are not committed"
    newest = max(path.stat().st_mtime for room in ROOMS for path in (SOURCE / room).rglob("*.[ch]pp"))
    if pathlib.Path(os.environ["SHAKERD"]).stat().st_mtime < newest:
        return "the program is older than its files; build it"
    return ""


class Page:
    """One run's line in docs/soak/NAME.jsonl. Its code is that of its begin: others may commit meanwhile."""

    def __init__(self, name):
        self.name, self.reason, self.code = name, why_not(), code()

    def keep(self, counts):
        """Adds the line; a sentence on what was done."""
        if self.reason:
            return f"not kept: {self.reason}"
        line = {"day": datetime.date.today().isoformat(), **counts, "code": self.code}
        with open(FOLDER / f"{self.name}.jsonl", "a", encoding="utf-8") as out:
            out.write(json.dumps(line) + "\n")
        return f"kept in docs/soak/{self.name}.jsonl"


def totals(name):
    """(runs, {count: sum}) of the lines whose code is the present one."""
    file, present, sums, runs = FOLDER / f"{name}.jsonl", code(), {}, 0
    for text in file.read_text(encoding="utf-8").splitlines() if file.exists() else []:
        line = json.loads(text)
        if line["code"] == present:
            runs += 1
            for key, value in line.items():
                if key != "seed" and isinstance(value, int):
                    sums[key] = sums.get(key, 0) + value
    return runs, sums


if __name__ == "__main__":
    for book in sorted(FOLDER.glob("*.jsonl")):
        count, sums = totals(book.stem)
        print(f"{book.stem}: {count} runs on the present code: "
              + (", ".join(f"{value} {key}" for key, value in sums.items()) or "none"))
