#!/usr/bin/python3
"""The n-th allocation of one thread fails, n = 1, 2, 3, ...: no end of the daemon leaves a table moving.

The real daemon, and the observer of the other rounds (README.md). Once: that allocation alone. For
good: all later ones of the thread too. A thread's sweep ends where no allocation was reached.
"""
import argparse
import multiprocessing
import shutil
import sys
import tempfile
from dataclasses import replace

import places  # noqa: F401  first: it says where the others are
import acts
import ledger
from places import end_with_parent, memory
from round import Round
from shim import compiled
from table import TABLE

THREADS = ("engine", "exciter", "acquisition", "recorder", "publisher", "estimator")
COUNTED = ("rounds", "starved", "died", "undecided", "violations")
ENOUGH = 5  # rounds in a row that reach none


def play(task):
    thread, for_good, nth, library, slack_s = task
    fault = TABLE[f"memory_{thread}_{'for_good' if for_good else 'once'}"]
    one = Round(f"memory:{thread}:{nth}", [fault.name], library, slack_s)
    name = "main" if thread == "publisher" else thread
    one.faults = [replace(fault, moment="measure", begin=acts.out_of_memory(name, for_good, nth))]
    return nth, one.run()


def numbers(step):
    """Each, and from 50 on wider and wider: the same places of the code are reached again and again."""
    n = 1
    while True:
        yield n
        n += max(1, int(n * step))


def sweep(workers, thread, for_good, library, options):
    sums, missed, waiting, nth = dict.fromkeys(COUNTED, 0), 0, [], 0
    made = numbers(options.step)
    while waiting or (missed < ENOUGH and nth < options.most):
        while missed < ENOUGH and nth < options.most and len(waiting) < options.parallel:
            nth = next(made)
            waiting.append(workers.apply_async(play, ((thread, for_good, nth, library, options.slack),)))
        n, result = waiting.pop(0).get()
        sums["rounds"] += 1
        sums["starved"] += result.starved
        sums["died"] += result.died
        sums["undecided"] += bool(result.undecided or result.skipped)
        sums["violations"] += len(result.violations)
        for sentence in result.violations:
            print(f"{thread}, {n}: VIOLATED: {sentence}", *result.story[-30:], sep="\n    ", flush=True)
        if missed < ENOUGH and not result.undecided:
            missed = 0 if result.starved else missed + 1
    print(f"{thread} {'for good' if for_good else 'once'}, to the {nth}th: "
          + ", ".join(f"{value} {key}" for key, value in sums.items()), flush=True)
    return sums


def main():
    parse = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parse.add_argument("--only", action="append", choices=THREADS)
    parse.add_argument("--step", type=float, default=0.02, help="part of n by which n grows, at least 1")
    parse.add_argument("--most", type=int, default=10**6, help="end at this n")
    parse.add_argument("--parallel", type=int, default=4)
    parse.add_argument("--slack", type=float, default=0.2)
    parse.add_argument("--keep", action="store_true", help="add the counts to docs/soak")
    options = parse.parse_args()
    page = ledger.Page("memory") if options.keep else None
    folder = tempfile.mkdtemp(prefix="nemesis.")
    tempfile.tempdir = memory()
    violations = 0
    with multiprocessing.get_context("fork").Pool(options.parallel, end_with_parent,
                                                 maxtasksperchild=20) as workers:
        library = compiled(folder)
        for thread in options.only or THREADS:
            for for_good in (False, True):
                sums = sweep(workers, thread, for_good, library, options)
                violations += sums["violations"]
                if page:
                    print(page.keep({"thread": thread, "for_good": for_good, **sums}))
    shutil.rmtree(folder, ignore_errors=True)
    return 1 if violations else 0


if __name__ == "__main__":
    sys.exit(main())
