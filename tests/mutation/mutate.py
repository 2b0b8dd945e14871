#!/usr/bin/env python3
"""Samples mutations of rooms and says which of them the rooms' own tests notice.

  mutate.py --work FOLDER --seed 1 --count 10 protocol drivers

A mutation changes one place of a source file: a comparison, a sign, a constant, a condition that is
negated, a statement that is removed. It is killed when the tests do not build or do not pass. The
work goes on in FOLDER: a worktree of the commit and a build of its own; the tree that this file
lies in is not touched. A table in FOLDER keeps what was tried, so that a command that was
interrupted goes on and results add up. README.md says more.
"""
import argparse
import contextlib
import csv
import fcntl
import os
import pathlib
import random
import re
import signal
import subprocess
import sys
import time

SOURCE = pathlib.Path(__file__).resolve().parents[2]
COLUMNS = ["commit", "room", "file", "line", "kind", "before", "after", "result", "seconds"]

# room: (build targets, commands in the build folder). Only tests that need neither root nor a wire.
ROOMS = {
    "protocol": (["test_protocol"], ["tests/protocol/test_protocol"]),
    "config": (["test_config"], ["tests/config/test_config"]),
    "drivers": (["test_drivers"], ["tests/drivers/test_drivers"]),
    "record": (["test_record"], ["tests/record/test_record"]),
    "daemon": (["test_daemon", "test_service", "test_publish", "test_workers"],
               ["tests/daemon/test_daemon", "tests/daemon/service/test_service",
                "tests/daemon/publish/test_publish", "tests/daemon/workers/test_workers"]),
}

LITERAL = re.compile(r'"(?:\\.|[^"\\])*"|\'(?:\\.|[^\'\\])+\'|//[^\n]*|/\*.*?\*/', re.DOTALL)
COMPARISON = re.compile(r"(?<=[\w)\]] )(<=|>=|==|!=|<|>)(?= [\w(*&:\"'-])")
SIGN = re.compile(r"(?<=[\w)\]] )([+-])(?= [\w(])")
CONSTANT = re.compile(r"(?<![\w.])(\d+(?:\.\d+)?(?:e-?\d+)?)(?![\w.]*['\w])")
CONDITION = re.compile(r"\bif \((?!const |auto |constexpr)([^;{}\n]+)\)(?= [^\n]*[;{]$)")
STATEMENT = re.compile(r"(?m)^( +)((?!return|break|continue|using|case|throw|const |auto )"
                       r"(?:\+\+|--)?[\w.>\-\[\]:*]+(?:\([^;\n]*\)| (?:[+\-|&^]?=) [^;\n]+|\+\+);)$")
OTHER = {"<": "<=", "<=": "<", ">": ">=", ">=": ">", "==": "!=", "!=": "==", "+": "-", "-": "+"}


def blanked(text):
    """The text with strings and comments as blanks, every character at its place."""
    return LITERAL.sub(lambda m: re.sub(r"[^\n]", " ", m.group()), text)


def other_constant(text):
    if text in ("0", "1"):
        return "1" if text == "0" else "0"
    if text == "0.0":
        return "1.0"
    return f"{2 * float(text):g}" if "." in text or "e" in text else str(int(text) + 1)


def mutations(path):
    """(offset, kind, before, after) of each place that can be changed."""
    text = path.read_text()
    code = blanked(text)
    for kind, pattern in (("comparison", COMPARISON), ("sign", SIGN)):
        for m in pattern.finditer(code):
            yield m.start(1), kind, m.group(1), OTHER[m.group(1)]
    for m in CONSTANT.finditer(code):
        if not code[code.rfind("\n", 0, m.start()) + 1:].startswith(("#", "template")):
            yield m.start(1), "constant", m.group(1), other_constant(m.group(1))
    for m in CONDITION.finditer(code):
        if m.group(1).count("(") == m.group(1).count(")"):
            before = text[m.start(1):m.end(1)]
            yield m.start(1), "condition", before, f"!({before})"
    for m in STATEMENT.finditer(code):
        before = text[m.start(2):m.end(2)]
        if not re.match(r"[\w:]+ [\w]+\(", before):
            yield m.start(2), "statement", before, ";"


def sample(tree, rooms, seed, count):
    """The kinds in turn, so that constants, which are many, do not crowd the others out."""
    found = {}
    for room in rooms:
        for path in sorted((tree / room).rglob("*.cpp")):
            for mutation in mutations(path):
                found.setdefault(mutation[1], []).append((room, path.relative_to(tree), *mutation))
    rng = random.Random(seed)
    for group in found.values():
        rng.shuffle(group)
    kinds = sorted(found)
    chosen = []
    while len(chosen) < count and any(found.values()):
        for kind in kinds:
            if found[kind] and len(chosen) < count:
                chosen.append(found[kind].pop())
    return chosen


class Worktree:
    """A checkout of one commit under the work folder, and a build of it."""

    def __init__(self, work, commit, jobs, lock):
        self.tree, self.build, self.jobs, self.lock = work / "tree", work / "build", jobs, lock
        if not (self.tree / ".git").exists():
            git("worktree", "add", "--detach", str(self.tree), commit)
        git("-C", str(self.tree), "checkout", "--quiet", "--force", "--detach", commit)
        if not (self.build / "build.ninja").exists():
            # Each file for itself: what a mutation touches is compiled, and no more.
            run(["cmake", "-S", str(self.tree), "-B", str(self.build), "-G", "Ninja", "-DSHAKER_BATCH=1",
                 "-DSHAKER_WERROR=OFF"], check=True)

    def make(self, targets):
        with contextlib.ExitStack() as held:
            if self.lock:
                fcntl.flock(held.enter_context(open(self.lock, "a")), fcntl.LOCK_EX)
            return run(["nice", "ninja", "-C", str(self.build), "-j", str(self.jobs), *targets]) == 0


def git(*arguments):
    return subprocess.run(["git", "-C", str(SOURCE), *arguments], check=True, capture_output=True,
                          text=True).stdout.strip()


def run(command, timeout=None, check=False, **more):
    """The exit status, or None when it took too long; its whole group has ended by then."""
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
                          start_new_session=True, **more) as process:
        try:
            status = process.wait(timeout)
        except (subprocess.TimeoutExpired, KeyboardInterrupt):
            os.killpg(process.pid, signal.SIGKILL)
            raise_again = sys.exc_info()[0] is KeyboardInterrupt
            process.wait()
            if raise_again:
                raise
            return None
    if check and status != 0:
        sys.exit(f"failed: {' '.join(command)}")
    return status


def tests_fail(worktree, room, timeout):
    for command in ROOMS[room][1]:
        status = run(["nice", str(worktree.build / command), "--gtest_fail_fast"], timeout, cwd=worktree.build)
        if status != 0:
            return "hung" if status is None else "killed"
    return None


def tried(table):
    if not table.exists():
        return set()
    with table.open(newline="") as file:
        return {(r["commit"], r["file"], r["line"], r["kind"], r["before"]) for r in csv.DictReader(file)}


def note(table, row):
    new = not table.exists()
    with table.open("a", newline="") as file:
        writer = csv.DictWriter(file, COLUMNS)
        if new:
            writer.writeheader()
        writer.writerow(row)


def attempt(worktree, mutation, timeout):
    """What became of one mutation. The file is as it was afterwards, whatever happens."""
    room, path, offset, _, before, after = mutation
    file = worktree.tree / path
    text = file.read_text()
    try:
        file.write_text(text[:offset] + after + text[offset + len(before):])
        if not worktree.make(ROOMS[room][0]):
            return "not compiled"
        return tests_fail(worktree, room, timeout) or "survived"
    finally:
        file.write_text(text)


def summary(table, commit):
    with table.open(newline="") as file:
        rows = [r for r in csv.DictReader(file) if r["commit"] == commit]
    for room in sorted({r["room"] for r in rows}):
        results = [r["result"] for r in rows if r["room"] == room and r["result"] != "not compiled"]
        killed = sum(r != "survived" for r in results)
        if results:
            print(f"{room}: {killed} of {len(results)} killed ({100 * killed / len(results):.0f} %)")


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("rooms", nargs="+", choices=sorted(ROOMS))
    parser.add_argument("--work", type=pathlib.Path, required=True, help="folder for worktree, build and table")
    parser.add_argument("--commit", default="HEAD")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--count", type=int, default=10)
    parser.add_argument("--timeout", type=float, default=300, help="of one test program, s")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--lock", help="file to lock while compiling, where others compile too")
    parser.add_argument("--list", action="store_true", help="only show the sample of the tree as it is")
    return parser.parse_args()


def main():
    options = arguments()
    if options.list:
        for room, path, offset, kind, before, after in sample(SOURCE, options.rooms, options.seed, options.count):
            line = (SOURCE / path).read_text().count("\n", 0, offset) + 1
            print(f"{path}:{line}: {kind}: {before} -> {after}")
        return
    work = options.work.resolve()
    if work == SOURCE or SOURCE in work.parents or work in SOURCE.parents:
        sys.exit(f"{work}: choose a folder outside of the sources")
    work.mkdir(parents=True, exist_ok=True)
    commit = git("rev-parse", options.commit)
    worktree = Worktree(work, commit, options.jobs, options.lock)
    table = work / "table.csv"
    for room in options.rooms:
        if not worktree.make(ROOMS[room][0]) or tests_fail(worktree, room, options.timeout):
            sys.exit(f"{room}: the tests fail without any mutation")
    done = tried(table)
    for mutation in sample(worktree.tree, options.rooms, options.seed, options.count):
        room, path, offset, kind, before, after = mutation
        line = (worktree.tree / path).read_text().count("\n", 0, offset) + 1
        if (commit, str(path), str(line), kind, before) in done:
            continue
        start = time.monotonic()
        result = attempt(worktree, mutation, options.timeout)
        note(table, dict(zip(COLUMNS, (commit, room, path, line, kind, before, after, result,
                                       round(time.monotonic() - start)))))
        print(f"{result:12} {path}:{line}: {kind}: {before} -> {after}", flush=True)
    summary(table, commit)


if __name__ == "__main__":
    main()
