#!/usr/bin/python3
"""docs/soak: what long runs found, one line of JSON a run, so that runs on the same code add up."""
import argparse
import datetime
import hashlib
import json
import os
import pathlib
import re
import shutil
import subprocess

from places import SOURCE

ROOMS = ("daemon", "drivers", "record")
SOURCES = (".cpp", ".hpp")
FOLDER = SOURCE / "docs" / "soak"
PROGRAMS = ("SHAKERD", "SHAKERCTL", "OLEOSIM")
# A raw string, a string, a character; then what says nothing to the compiler: comments and blanks.
TOKEN = re.compile(r'(R"([^()\s]*)\(.*?\)\2"|"(?:\\.|[^"\\\n])*"|\'(?:\\[^\n]{1,4}?|[^\'\\\n])\')'
                   r"|//[^\n]*|/\*.*?\*/|\s+", re.DOTALL)


def git(*words, **more):
    return subprocess.run(["git", "-C", str(SOURCE), *words], capture_output=True, check=True, **more).stdout


def essence(text):
    """C++ without comments and blanks: the same for files that compile to the same program."""
    return TOKEN.sub(lambda found: found.group(1) or "", text)


def digest(files):
    """The id of {name: text}."""
    whole = hashlib.sha256()
    for name, text in sorted(files.items()):
        whole.update(f"{name}\0{essence(text)}\0".encode())
    return whole.hexdigest()[:12]


def committed(room):
    """{name: text} of the C++ files of a room in HEAD."""
    names = [name for name in git("ls-tree", "-r", "--name-only", "HEAD", "--", room, text=True).splitlines()
             if name.endswith(SOURCES)]
    octets = git("cat-file", "--batch", input="".join(f"HEAD:{name}\n" for name in names).encode())
    files = {}
    for name in names:
        head, octets = octets.split(b"\n", 1)
        size = int(head.split()[-1])
        files[name], octets = octets[:size].decode(), octets[size + 1:]
    return files


def written(room):
    """The same of the files as they lie there."""
    return {str(path.relative_to(SOURCE)): path.read_text(encoding="utf-8")
            for path in (SOURCE / room).rglob("*") if path.suffix in SOURCES}


def code(files=committed):
    """{room: an id of what its C++ files say to the compiler}."""
    return {room: digest(files(room)) for room in ROOMS}


def label():
    """What lies beside a copy of the programs: the code that they were made of."""
    return pathlib.Path(os.environ["SHAKERD"]).with_name("code.json")


def why_not():
    """Why it cannot be said which code the programs were made of; empty when it can."""
    newest = max(path.stat().st_mtime for room in ROOMS for path in (SOURCE / room).rglob("*.[ch]pp"))
    if pathlib.Path(os.environ["SHAKERD"]).stat().st_mtime < newest:
        return "the program is older than its files; build it"
    return ""


def copy_programs(folder):
    """The programs, and what they were made of: a build that goes on meanwhile does not touch them."""
    if reason := why_not():
        return f"not copied: {reason}"
    folder.mkdir(parents=True, exist_ok=True)
    for name in PROGRAMS:
        shutil.copy2(os.environ[name], folder)
    (folder / "code.json").write_text(json.dumps(code(written)))
    return f"copied; SHAKER_BIN={folder} makes the other commands use them"


class Page:
    """One run's line in docs/soak/NAME.jsonl. Its code is what lay there when it began."""

    def __init__(self, name):
        self.name = name
        if label().exists():
            self.reason, self.code = "", json.loads(label().read_text())
        else:
            self.reason, self.code = why_not(), code(written)

    def keep(self, counts):
        """Adds the line; a sentence on what was done."""
        if self.reason:
            return f"not kept: {self.reason}"
        line = {"day": datetime.date.today().isoformat(), **counts, "code": self.code}
        with open(FOLDER / f"{self.name}.jsonl", "a", encoding="utf-8") as out:
            out.write(json.dumps(line) + "\n")
        return f"kept in docs/soak/{self.name}.jsonl"


def lines(name):
    file = FOLDER / f"{name}.jsonl"
    return [json.loads(text) for text in file.read_text(encoding="utf-8").splitlines()] if file.exists() else []


def equals(present, judged):
    """{room: ids}: the present code, and earlier code that a person judged equal for the table and the record."""
    ids = {room: [newest] for room, newest in present.items()}
    for line in reversed(judged):
        if line["code"] in ids[line["room"]]:
            ids[line["room"]].append(line["equals"])
    return ids


def totals(name):
    """(runs, {count: sum}) of the lines whose code is the present one, or judged equal to it."""
    ids, sums, runs = equals(code(), lines("equal_code")), {}, 0
    for line in lines(name):
        if all(line.get("code", {}).get(room) in of_room for room, of_room in ids.items()):
            runs += 1
            for key, value in line.items():
                if isinstance(value, int) and not isinstance(value, bool):
                    sums[key] = sums.get(key, 0) + value
    return runs, sums


def main():
    parse = argparse.ArgumentParser(description=__doc__)
    parse.add_argument("--copy-programs", type=pathlib.Path, metavar="FOLDER",
                       help="copy the programs for a long run beside builds")
    options = parse.parse_args()
    if options.copy_programs:
        print(copy_programs(options.copy_programs.resolve()))
        return
    for name in ("kills", "nemesis", "sweeps"):
        count, sums = totals(name)
        print(f"{name}: {count} runs on the present code: "
              + (", ".join(f"{value} {key}" for key, value in sums.items()) or "none"))
    for line in lines("equal_code"):
        print(f"{line['room']} {line['code']} counts as {line['equals']}: {line['why']}")


if __name__ == "__main__":
    main()
