#!/usr/bin/python3
"""The n-th allocation of a thread, or the n-th call on a file, fails, n = 1, 2, 3, ...: no table is left moving.

The real daemon, and the observer of the other rounds (README.md). Once: that allocation or call alone. For good: all
later ones too. A sweep ends where none was reached.
"""
import argparse
import multiprocessing
import shutil
import sys
import tempfile

import places  # noqa: F401  first: it says where the others are
import acts
import ledger
from places import end_with_parent, memory
from round import Round
from shim import compiled
from table import ANY, Fault

THREADS = ("engine", "exciter", "acquisition", "recorder", "publisher", "estimator")
FILES = ("files_at_start", "files")  # from the start of a campaign on; from somewhere in its measurement on
COUNTED = ("rounds", "reached", "died", "undecided", "violations")
ENOUGH = 5  # rounds in a row that reach none


class AtStart(Round):
    """A campaign whose files cannot be made is refused; otherwise it goes on, or stops."""

    def play(self):
        self.stand.start_daemon()
        self.begin("campaign")
        try:
            self.stand.begin_campaign()
        except AssertionError as refused:
            if "'error'" not in str(refused):
                raise
        else:
            self.await_outcome()
        self.look_after()


def fault(what, for_good, nth):
    if what in FILES:
        return Fault(what, ANY, 0, "it goes on, or stops", acts.call_fails(nth, for_good), silent=True,
                     moment="campaign" if what == "files_at_start" else "measure")
    thread = "main" if what == "publisher" else what
    return Fault(f"memory_{what}", ANY, 0, "it goes on, stops, or ends: the dead-man",
                 acts.out_of_memory(thread, for_good, nth), silent=True, may_die=True, moment="measure")


def play(task):
    what, for_good, nth, library, slack_s = task
    one = (AtStart if what == "files_at_start" else Round)(f"{what}:{nth}", [], library, slack_s)
    one.faults = [fault(what, for_good, nth)]
    return nth, one.run()


def numbers(step):
    """Each, and from 50 on wider and wider: the same places of the code are reached again and again."""
    n = 1
    while True:
        yield n
        n += max(1, int(n * step))


def sweep(workers, what, for_good, library, options):
    sums, missed, waiting, nth = dict.fromkeys(COUNTED, 0), 0, [], 0
    made = numbers(options.step)
    while waiting or (missed < ENOUGH and nth < options.most):
        while missed < ENOUGH and nth < options.most and len(waiting) < options.parallel:
            nth = next(made)
            waiting.append(workers.apply_async(play, ((what, for_good, nth, library, options.slack),)))
        n, result = waiting.pop(0).get()
        sums["rounds"] += 1
        sums["reached"] += result.reached
        sums["died"] += result.died
        sums["undecided"] += bool(result.undecided or result.skipped)
        sums["violations"] += len(result.violations)
        for sentence in result.violations:
            print(f"{what}, {n}: VIOLATED: {sentence}", *result.story[-30:], sep="\n    ", flush=True)
        if missed < ENOUGH and not result.undecided:
            missed = 0 if result.reached else missed + 1
    print(f"{what} {'for good' if for_good else 'once'}, to the {nth}th: "
          + ", ".join(f"{value} {key}" for key, value in sums.items()), flush=True)
    return sums


def main():
    parse = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parse.add_argument("--only", action="append", choices=(*THREADS, *FILES))
    parse.add_argument("--step", type=float, default=0.02, help="part of n by which n grows, at least 1")
    parse.add_argument("--most", type=int, default=10**6, help="end at this n")
    parse.add_argument("--parallel", type=int, default=4)
    parse.add_argument("--slack", type=float, default=0.2)
    parse.add_argument("--keep", action="store_true", help="add the counts to docs/soak")
    options = parse.parse_args()
    page = ledger.Page("sweeps") if options.keep else None
    folder = tempfile.mkdtemp(prefix="nemesis.")
    tempfile.tempdir = memory()
    violations = 0
    with multiprocessing.get_context("fork").Pool(options.parallel, end_with_parent,
                                                  maxtasksperchild=20) as workers:
        library = compiled(folder)
        for what in options.only or (*THREADS, *FILES):
            for for_good in (False, True):
                sums = sweep(workers, what, for_good, library, options)
                violations += sums["violations"]
                if page:
                    print(page.keep({"what": what, "for_good": for_good, **sums}))
    shutil.rmtree(folder, ignore_errors=True)
    return 1 if violations else 0


if __name__ == "__main__":
    sys.exit(main())
