#!/usr/bin/env python3
"""Samples mutations of rooms and says which of them the rooms' own tests notice.

  mutate.py --work FOLDER --seed 1 --count 10 protocol drivers

A mutation changes one place of a source file: a comparison, a sign, a constant, a condition that is
negated, a statement that is removed. It is killed when the tests do not pass. The work goes on in
FOLDER: a clone of the commit and a build of its own; the tree that this file lies in is not
touched. A table of lines of JSON keeps what was tried, so that a command that was interrupted goes
on and results add up. README.md says more.
"""
import argparse
import concurrent.futures
import contextlib
import datetime
import fcntl
import json
import os
import pathlib
import re
import subprocess
import sys
import threading
import time

from places_to_change import sample
from programs import ELSEWHERE, ROOMS, Programs, run_tests
from together import Together

SOURCE = pathlib.Path(__file__).resolve().parents[2]
NOT_COUNTED = ("not compiled", "same program")


def git(*arguments):
    return subprocess.run(["git", *arguments], check=True, capture_output=True, text=True).stdout.strip()


def run(command):
    return subprocess.run(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, check=False).returncode


class Clone:
    """A checkout of one commit under the work folder, and a build of it."""

    def __init__(self, work, commit, options):
        self.tree, self.jobs, self.lock = work / "tree", options.jobs, options.lock
        # Inside the tree as a developer's, so that ccache knows what has not changed.
        self.build = work / "build" if options.apart else self.tree / "build"
        if not (self.tree / ".git").exists():
            git("clone", "--quiet", "--no-checkout", str(SOURCE), str(self.tree))
        git("-C", str(self.tree), "fetch", "--quiet", "origin")
        git("-C", str(self.tree), "checkout", "--quiet", "--force", "--detach", commit)
        configure = ["cmake", "-S", str(self.tree), "-B", str(self.build), "-G", "Ninja"]
        if options.apart:
            # Each file for itself: what a mutation touches is compiled, and no more. -O1 compiles twice as
            # fast as -O2, and the tests are no slower than that gains.
            configure += ["-DSHAKER_BATCH=1", "-DSHAKER_WERROR=OFF", "-DSHAKER_BENCH=OFF",
                          "-DCMAKE_BUILD_TYPE=Mutation", "-DCMAKE_CXX_FLAGS_MUTATION=-O1",
                          "-DCMAKE_C_FLAGS_MUTATION=-O1"]
        if not (self.build / "build.ninja").exists() and run(configure) != 0:
            sys.exit(f"failed: {' '.join(configure)}")

    def make(self, targets):
        with contextlib.ExitStack() as held:
            if self.lock:
                fcntl.flock(held.enter_context(open(self.lock, "a")), fcntl.LOCK_EX)
            return run(["ninja", "-C", str(self.build), "-j", str(self.jobs), *targets]) == 0


class Table:
    """docs/soak/mutations.jsonl, or another file of such lines."""

    def __init__(self, path):
        self.path = path
        self.rows = [json.loads(line) for line in path.read_text().splitlines()] if path.exists() else []

    def tried(self, row):
        same = ("commit", "file", "line", "column", "kind", "before")
        return any(all(r[key] == row[key] for key in same) for r in self.rows)

    def save(self):
        fresh = self.path.with_suffix(".new")
        fresh.write_text("".join(json.dumps(row) + "\n" for row in self.rows))
        fresh.replace(self.path)

    def summary(self):
        """Of those that were not judged equivalent."""
        for room in [*sorted({r["room"] for r in self.rows}), None]:
            rows = [r for r in self.rows if room in (r["room"], None) and r["result"] not in NOT_COUNTED]
            equivalent = sum(r.get("judged") == "equivalent" for r in rows)
            counted = [r for r in rows if r.get("judged") != "equivalent"]
            killed = sum(r["result"] != "survived" for r in counted)
            first = killed - sum("survived_at" in r for r in counted)
            if counted:
                print(f"{room or 'all'}: {killed} of {len(counted)} killed "
                      f"({100 * killed / len(counted):.0f} %), {first} of them before tests were added; "
                      f"{equivalent} more change no behaviour")


def line_of(text, offset):
    """(number, text) of the line that holds the place."""
    number = text.count("\n", 0, offset)
    return number + 1, text.split("\n")[number].strip()


def place_again(tree, row):
    """Where a row's mutation is now; None when its line is no more. Of equal lines, the nearest one."""
    text = (tree / row["file"]).read_text() if (tree / row["file"]).exists() else ""
    same = [m.start() for m in re.finditer(re.escape(row["source"]), text)]
    at = min(same, key=lambda offset: abs(line_of(text, offset)[0] - row["line"]), default=len(text))
    offset = text.find(row["before"], at + row.get("column", 0))
    return None if offset < 0 else (row["room"], pathlib.Path(row["file"]), offset, row["kind"],
                                    row["before"], row["after"])


class Session:
    def __init__(self, options):
        self.options = options
        self.commit = git("-C", str(SOURCE), "rev-parse", options.commit)
        self.clone = Clone(options.work, self.commit, options)
        self.programs = Programs(self.clone.build, options.work / "run")
        self.table, self.noting = Table(options.table), threading.Lock()

    def baseline(self, rooms):
        """Every test passes without any mutation."""
        for room in rooms:
            if not self.clone.make(ROOMS[room].targets):
                sys.exit(f"{room}: does not compile without any mutation")
            self.programs.remember(room)
            result, by = run_tests(self.programs.copies(room, changed_only=False), self.options)
            if result != "survived":
                sys.exit(f"{room}: {by} fails without any mutation")

    def build(self, mutation):
        """Copies of the test programs that a mutation changes; None when it does not compile."""
        room, path, offset, _, before, after = mutation
        file = self.clone.tree / path
        text = file.read_text()
        try:
            file.write_text(text[:offset] + after + text[offset + len(before):])
            if not self.clone.make(ROOMS[room].targets):
                return None
            return self.programs.copies(room, path=str(path))
        finally:
            file.write_text(text)

    def attempt(self, mutations, note):
        """All in one build, or each in its own."""
        if self.options.apart:
            self.baseline(self.options.rooms)
            return self.attempt_apart(mutations, note)
        rooms = [room for room in self.options.rooms if any(m[0] == room for _, m in mutations)]
        together = Together(self, mutations)
        together.make(rooms)
        together.trace(rooms)
        numbers = [number for number in together.numbered if number not in together.left_out]
        with concurrent.futures.ThreadPoolExecutor(self.options.jobs) as testers:
            list(testers.map(lambda n: self.noted(mutations[n - 1][0], time.monotonic(), note, *together.judge(n)),
                             numbers))

    def attempt_apart(self, mutations, note):
        """Compiles one while the tests of those before it run."""
        with concurrent.futures.ThreadPoolExecutor(self.options.jobs) as testers:
            waiting = []
            for row, mutation in mutations:
                began = time.monotonic()
                waiting.append(testers.submit(self.judge, self.build(mutation), row, began, note))
                while len([w for w in waiting if not w.done()]) > self.options.jobs:
                    time.sleep(0.1)
            for done in waiting:
                done.result()

    def judge(self, copies, row, began, note):
        if copies is None:
            result, by = "not compiled", ""
        elif not copies.programs:
            result, by = "same program", ""
        else:
            result, by = run_tests(copies, self.options)
        self.noted(row, began, note, result, by)

    def noted(self, row, began, note, result, by):
        print(f"{result:12} {row['file']}:{row['line']}: {row['kind']}: {row['before']} -> {row['after']}  {by}",
              flush=True)
        with self.noting:
            note(row, {"result": result, "by": by, "seconds": round(time.monotonic() - began)})
            self.table.save()

    def described(self, mutation):
        """A row without its result."""
        room, path, offset, kind, before, after = mutation
        text = (self.clone.tree / path).read_text()
        number, source = line_of(text, offset)
        begin = text.find(source, text.rfind("\n", 0, offset) + 1)
        return {"day": datetime.date.today().isoformat(), "commit": self.commit, "seed": self.options.seed,
                "room": room, "file": str(path), "line": number, "column": offset - begin, "kind": kind,
                "before": before, "after": after, "source": source}

    def sampled(self):
        def note(row, found):
            self.table.rows.append({**row, **found})
        mutations = [m for m in sample(self.clone.tree, self.options.rooms, self.options.seed, self.options.count)
                     if str(m[1]) not in ELSEWHERE]
        rows = [(self.described(mutation), mutation) for mutation in mutations]
        self.attempt([(row, mutation) for row, mutation in rows if not self.table.tried(row)], note)

    def survivors_again(self):
        def note(row, found):
            if found["result"] in ("killed", "hung"):
                row.update({"survived_at": row["commit"], "commit": self.commit, **found})
        rows = [r for r in self.table.rows if r["result"] == "survived" and r.get("judged") != "equivalent"
                and r["room"] in self.options.rooms]
        self.attempt([(r, m) for r in rows if (m := place_again(self.clone.tree, r))], note)


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("rooms", nargs="*", choices=[[], *sorted(ROOMS)])
    parser.add_argument("--work", type=pathlib.Path, help="folder for clone, build and copies of programs")
    parser.add_argument("--commit", default="HEAD")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--count", type=int, default=10)
    parser.add_argument("--apart", action="store_true", help="a build for each mutation, also of constants that the "
                        "compiler needs")
    parser.add_argument("--again", action="store_true", help="try the table's survivors again at --commit")
    parser.add_argument("--table", type=pathlib.Path, default=SOURCE / "docs" / "soak" / "mutations.jsonl")
    parser.add_argument("--timeout", type=float, default=120, help="of a part of a test program, s")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--lock", help="file to lock while compiling, where others compile too")
    parser.add_argument("--list", action="store_true", help="only show the sample of the tree as it is")
    parser.add_argument("--sums", action="store_true", help="only show the sums of the table")
    return parser.parse_args()


def main():
    options = arguments()
    options.rooms = options.rooms or ["daemon", "drivers", "protocol", "record"]
    if options.sums:
        return Table(options.table).summary()
    if options.list:
        for room, path, offset, kind, before, after in sample(SOURCE, options.rooms, options.seed, options.count):
            number, _ = line_of((SOURCE / path).read_text(), offset)
            print(f"{path}:{number}: {kind}: {before} -> {after}")
        return None
    options.work = (options.work or sys.exit("name a folder: --work FOLDER")).resolve()
    if options.work == SOURCE or SOURCE in options.work.parents or options.work in SOURCE.parents:
        sys.exit(f"{options.work}: choose a folder outside of the sources")
    options.work.mkdir(parents=True, exist_ok=True)
    os.environ.setdefault("GTEST_COLOR", "no")
    session = Session(options)
    if options.again:
        session.survivors_again()
    else:
        session.sampled()
    return session.table.summary()


if __name__ == "__main__":
    main()
