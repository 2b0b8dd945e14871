"""All mutations of a sample in one build: SHAKER_MUTANT says which of them is done (mutant.hpp).

One compilation then serves them all, and a run of the tests without any says which parts of the
tests reach which of them. What only stands where the compiler needs a constant is left out.
"""
import collections
import os
import pathlib
import re
import subprocess
import sys
import tempfile

from places_to_change import blanked
from programs import ROOMS, start, wait_for

SPACE = "::shaker::mutation::"
NAMES = {"<": "Less", "<=": "LessEqual", ">": "Greater", ">=": "GreaterEqual", "==": "Equal", "!=": "Unequal",
         "+": "Plus", "-": "Minus"}
SHARDS = 24  # of a program: a mutation is tried on those that reach it
HEADER = "tests/mutation/mutant.hpp"


def edits(number, mutation):
    """[(offset, order, length, text)] that let `number` choose the mutation."""
    _, _, offset, kind, before, after = mutation
    end, chosen = offset + len(before), f"{SPACE}is({number})"
    if kind in ("comparison", "sign"):
        return [(end, 0, 0, f" {SPACE}{NAMES[before]}<{number}, {SPACE}Other{NAMES[after]}>{{}} {before}")]
    if kind == "constant":
        return [(offset, 2, len(before), f"({chosen} ? {after} : {before})")]
    if kind == "condition":
        return [(offset, 1, 0, f"{chosen} != static_cast<bool>("), (end, 0, 0, ")")]
    return [(offset, 0, 0, f"{{ if (!{chosen}) "), (end, 1, 0, " }")]


def written(text, path, numbered):
    """The file with these mutations in it; each stays on its line."""
    code = blanked(text)
    made = []
    for number, mutation in numbered:
        made += edits(number, mutation)
        begin = code.rfind("\n", 0, mutation[2]) + 1
        fixed = re.compile(r"\s*((static|inline) )*constexpr ").match(code, begin)
        if fixed and mutation[3] in ("constant", "sign", "comparison"):
            at = code.index("constexpr", begin)
            made.append((at, -1, len("constexpr"), "const"))
    for offset, _, length, new in sorted(set(made), reverse=True):
        text = text[:offset] + new + text[offset + length:]
    return f'#include "{HEADER}"\n#line 1 "{path}"\n{text}'


class Together:
    """A tree of its own with all mutations, and what reaches them."""

    def __init__(self, session, mutations):
        self.session, self.tree, self.build = session, session.clone.tree, session.clone.build
        self.numbered = {1 + i: mutation for i, (_, mutation) in enumerate(mutations)}
        self.left_out = set()
        self.reached = {}  # number: {(program, shard)}

    def make(self, rooms):
        targets = [target for room in rooms for target in ROOMS[room].targets]
        if not self.session.clone.make(targets):
            sys.exit("does not compile without any mutation")
        (self.tree / HEADER).write_text((pathlib.Path(__file__).parent / "mutant.hpp").read_text())
        self.originals = {str(m[1]): (self.tree / m[1]).read_text() for m in self.numbered.values()}
        try:
            self.fit(targets)
        finally:
            for path, text in self.originals.items():
                (self.tree / path).write_text(text)

    def write(self):
        for path, text in self.originals.items():
            own = [(n, m) for n, m in self.numbered.items() if str(m[1]) == path and n not in self.left_out]
            new = written(text, path, own) if own else text
            if (self.tree / path).read_text() != new:
                (self.tree / path).write_text(new)

    def fit(self, targets):
        """Leaves out what does not compile, line by line, until the rest does."""
        while True:
            self.write()
            said = subprocess.run(["ninja", "-C", str(self.build), "-k", "0", "-j", str(self.session.clone.jobs),
                                   *targets], capture_output=True, text=True, check=False)
            if said.returncode == 0:
                return
            left = {number: m for number, m in self.numbered.items() if number not in self.left_out}
            bad = {(path, int(n)) for path, n in re.findall(r"([\w./-]+\.cpp):(\d+):", said.stdout)}
            names = set(re.findall(r"value of ['‘](?:\w+::|\(anonymous namespace\)::)*(\w+)['’]", said.stdout))
            out = {number for number, m in left.items() if self.blamed(m, bad, names)}
            if not out:
                sys.exit(f"does not compile with all mutations:\n{said.stdout[-3000:]}")
            self.left_out |= out
            print(f"{len(out)} of {len(left)} need the compiler, and are left out", flush=True)

    def blamed(self, mutation, bad, names):
        path, text = str(mutation[1]), self.originals[str(mutation[1])]
        first = text.count("\n", 0, mutation[2])
        lines = range(first - 1, first + mutation[4].count("\n") + 1)  # the one before may lack its end
        return (any((path, line + 1) in bad for line in lines)
                or names & set(re.findall(r"\w+", text.split("\n")[first])))

    def trace(self, rooms):
        """Every part of every program without a mutation: it passes, and says what it reaches."""
        for room in rooms:
            for program in ROOMS[room].programs.values():
                waiting = [(program, shard) for shard in range(SHARDS)]
                while waiting:
                    part = waiting.pop(0)
                    with tempfile.NamedTemporaryFile("r", dir=self.session.options.work) as notes:
                        failed = self.run(part, 0, SHAKER_MUTANTS_REACHED=notes.name)
                        if failed and self.run_test(program, 0, failed.test):
                            sys.exit(f"{failed.test} of {program} fails without any mutation")
                        for number in map(int, notes.read().split()):
                            self.reached.setdefault(number, set()).add(part)

    def run(self, part, number, **more):
        program, shard = part
        return self.wait(start(self.build / program, self.build, SHAKER_MUTANT=str(number), **more,
                               GTEST_TOTAL_SHARDS=str(SHARDS), GTEST_SHARD_INDEX=str(shard)))

    def run_test(self, program, number, test):
        """Whether it fails."""
        words = [f"--gtest_filter={test}"] if test else []
        return self.wait(start(self.build / program, self.build, *words, SHAKER_MUTANT=str(number))) is not None

    def wait(self, process):
        return wait_for([process], self.session.options.timeout)

    def judge(self, number):
        """("survived", "killed" or "hung", the test that noticed)."""
        mutation = self.numbered[number]
        room = ROOMS[mutation[0]].programs
        own = max((f for f in room if str(mutation[1]).startswith(f + "/")), key=len, default="")
        parts = sorted(self.reached.get(number, ()), key=lambda part: (part[0] != room[own], part))
        for part in parts:
            failed = self.run(part, number)
            if not failed:
                continue
            # A busy machine fails tests too: it must fail again with the mutation, and pass without.
            if self.run_test(part[0], number, failed.test) and not self.run_test(part[0], 0, failed.test):
                return ("hung" if failed.hung else "killed"), failed.test
        return "survived", "" if parts else "no test reaches it"


if os.environ.get("SHAKER_MUTANT"):
    sys.exit("SHAKER_MUTANT is set already; unset it")
