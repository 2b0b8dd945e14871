#!/usr/bin/python3
"""Random faults against the real daemon, an independent observer, and what must hold: README.md."""
import argparse
import multiprocessing
import random
import shutil
import signal
import sys
import tempfile
import time
import traceback

import places  # noqa: F401  first: it says where the others are
import ledger
from places import Progress, end_with_parent, memory
from round import Result, Round
from shim import compiled
from table import TABLE, choose

COUNTED = ("rounds", "faults", "acknowledged", "violations")


def play(task):
    """In a process of its own: a round with the name of its seed."""
    sys.setswitchinterval(0.001)
    seed, names, library, slack_s = task
    try:
        return Round(seed, names, library, slack_s).run()
    except Exception:  # of the test itself: it is told with its place, and the others go on
        return Result(seed, names, violations=[traceback.format_exc()])


def tasks(options, library):
    number = options.first
    while True:
        seed = f"{options.seed}:{number}"
        if options.only:
            names = [options.only[number % len(options.only)]]
        elif options.sweep:
            names = [sorted(pool(options))[number % len(pool(options))]]
        else:
            names = choose(random.Random("names " + seed), pool(options))
        yield seed, names, library, options.slack
        number += 1


def pool(options):
    """The faults that are drawn from; those that do not hold yet only where they are asked for."""
    return {name: fault for name, fault in TABLE.items() if options.open or not fault.open}


class Tally:
    def __init__(self):
        self.began = time.monotonic()
        self.sums = dict.fromkeys(COUNTED, 0)
        self.rows = {}  # fault: [tries, held, worst s to rest]
        self.notes = []

    def add(self, result):
        if result.skipped:
            self.notes.append(f"skipped {' and '.join(result.faults)}: {result.skipped}")
            return
        if result.undecided and not result.violations:
            self.notes.append(f"undecided {result.seed}: {result.undecided}")
            return
        self.sums["rounds"] += 1
        self.sums["faults"] += len(result.faults)
        self.sums["acknowledged"] += result.acknowledged
        self.sums["violations"] += len(result.violations)
        for name in result.faults:
            row = self.rows.setdefault(name, [0, 0, 0.0])
            row[0] += 1
            row[1] += not result.violations
            if len(result.faults) == 1:
                row[2] = max(row[2], result.to_rest.get(name, 0.0))

    def progress(self):
        minutes = (time.monotonic() - self.began) / 60
        s = self.sums
        return (f"{s['rounds']} rounds, {s['faults']} faults, {s['acknowledged']} acknowledged, "
                f"{s['violations']} violations, {s['faults'] / max(minutes, 0.01):.0f} faults a minute")

    def table(self):
        yield f"{'fault':32}{'effect':>12}{'bound s':>9}{'tries':>7}{'held':>6}{'worst s':>9}"
        for name in (n for n in TABLE if n in self.rows):
            tries, held, worst = self.rows[name]
            fault = TABLE[name]
            bound = f"{fault.bound_s:.2f}" if fault.bound_s else "-"
            yield (f"{name:32}{fault.effect:>12}{bound:>9}{tries:>7}{held:>6}"
                   f"{worst if worst else '-':>9{'.2f' if worst else ''}}")
        yield from self.notes


def report(result):
    print(f"\nround {result.seed}: {' and '.join(result.faults)}")
    for sentence in result.violations:
        print(f"  VIOLATED: {sentence}")
    for line in result.story[-30:]:
        print(f"    {line}")


def run(options):
    page = ledger.Page("nemesis") if options.keep else None
    folder = tempfile.mkdtemp(prefix="nemesis.")
    tempfile.tempdir = memory()
    tally, line = Tally(), Progress()
    end = time.monotonic() + 60 * options.minutes if options.minutes else float("inf")
    made = tasks(options, compiled(folder))
    ignore = signal.signal(signal.SIGINT, signal.SIG_IGN)
    with multiprocessing.get_context("fork").Pool(options.parallel, end_with_parent,
                                                     maxtasksperchild=20) as workers:
        signal.signal(signal.SIGINT, ignore)
        try:
            waiting, begun = [], 0
            while waiting or (begun < options.count and time.monotonic() < end):
                while (len(waiting) < options.parallel and begun < options.count
                       and time.monotonic() < end):
                    waiting.append(workers.apply_async(play, (next(made),)))
                    begun += 1
                for done in [w for w in waiting if w.ready()]:
                    waiting.remove(done)
                    result = done.get()
                    tally.add(result)
                    if result.violations:
                        report(result)
                    line.show(tally.progress())
                time.sleep(0.02)
        except KeyboardInterrupt:
            print("\nended by hand; what was done is counted")
    shutil.rmtree(folder, ignore_errors=True)
    print()
    for line in tally.table():
        print(line)
    print(tally.progress())
    if page:
        print(page.keep({"seed": options.seed, **tally.sums}))
    return tally


def main():
    parse = argparse.ArgumentParser(description=__doc__)
    parse.add_argument("--count", type=int, default=10**9, help="rounds")
    parse.add_argument("--minutes", type=float, help="begin no round after so long")
    parse.add_argument("--seed", default="1")
    parse.add_argument("--first", type=int, default=0, help="number of the first round: SEED:FIRST is the "
                       "round that a violation names")
    parse.add_argument("--only", action="append", choices=sorted(TABLE), metavar="FAULT",
                       help="this fault alone, each round; repeatable: in turn")
    parse.add_argument("--sweep", action="store_true", help="every fault alone, one after the other")
    parse.add_argument("--open", action="store_true", help="faults too that do not hold yet")
    parse.add_argument("--parallel", type=int, default=4, help="daemons at once")
    parse.add_argument("--slack", type=float, default=0.2, help="s on every bound, beside the lateness "
                       "that the observer sees of itself")
    parse.add_argument("--keep", action="store_true", help="add the counts to docs/soak")
    parse.add_argument("--list", action="store_true", help="the table of faults, and no run")
    options = parse.parse_args()
    if options.list:
        for fault in TABLE.values():
            print(f"{fault.name:32}{fault.effect:>12}{fault.bound_s:6.2f} s  {fault.why}"
                  + (f"; open: {fault.open}" if fault.open else ""))
        return 0
    if options.count == 10**9 and options.minutes is None:
        options.count = len(pool(options)) if options.sweep else len(options.only or [1])
    tally = run(options)
    if not tally.sums["rounds"]:
        print("nothing could be tried: see above")
        return 77
    return 1 if tally.sums["violations"] else 0


if __name__ == "__main__":
    sys.exit(main())
