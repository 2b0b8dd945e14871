#!/usr/bin/python3
"""kill -9 at random moments: nothing that a client has seen is missing, and the next daemon starts.

Real processes and real files. The rig is the one inside the daemon. Its dwell is fast and any cycle
counts as steady, so that the first estimate comes two and a half seconds after the start.
"""
import argparse
import contextlib
import multiprocessing
import os
import random
import signal
import sqlite3
import subprocess
import sys
import tempfile
import time

import places  # noqa: F401  first: it says where the others are
import freeze
import ledger
from crowd import DIES_WITH_US
from daemon import CAMPAIGN, RIG, Daemon
from observer import waited
from places import Progress, end_with_parent, memory
from witness import Witness, integrity, missing

FAST = {**CAMPAIGN, "name": "kills", "ramp_s": 0.05, "settle_tolerance": 1000.0,
        "runs": [{"name": "fast", "frequency_hz": 10.0, "amplitude": 3.0, "cycles": 100000}]}
COUNTED = ("kills", "acknowledged", "cycles", "estimates", "lost", "wrong", "undecided")


class Mortal(Daemon):
    def command(self, *words):
        return [*DIES_WITH_US, *super().command(*words)]


class Lives:
    """One daemon, killed and started again in one folder; what it left is compared each time."""

    def __init__(self, seed):
        self.random = random.Random(seed)
        sensor = {**RIG["sensors"][0], "rate_hz": 400}
        limits = {**RIG["limits"], "stale_s": 2.0}  # several share the machine
        self.daemon = Mortal({**RIG, "sensors": [sensor], "limits": limits})
        self.counts = dict.fromkeys(COUNTED, 0)
        self.sentences = []

    def live(self):
        """A campaign, a kill in it, and the next start, which recovers and is compared."""
        witness = None
        try:
            self.step()
            if not self.daemon.process:
                self.daemon.start()
            witness = Witness(self.daemon.socket)
            self.begin(witness)
            if self.random.random() < 0.8:
                with contextlib.suppress(AssertionError):  # a busy machine: then it is any moment
                    witness.until(lambda line: line.get("type") == "estimate", 20)
                time.sleep(1.0 * self.random.random())
            else:
                time.sleep(2.5 * self.random.random())
            self.kill(witness)
            if self.random.random() < 0.2:
                self.kill_at_start()
            self.step()
            self.daemon.start()
            self.await_recovery()
            self.compare(witness)
        except AssertionError as trouble:
            self.late(f"{str(trouble)[:300]} ... {str(trouble)[-600:]}")
            self.daemon.kill()
            self.daemon.process = None
        finally:
            if witness:
                witness.close()
            self.clear()

    def begin(self, witness):
        """A start that a starved machine kept from its answer is as good a moment for a kill as another."""
        self.step()
        try:
            witness.start(FAST)
        except AssertionError as trouble:
            self.late(f"the campaign did not start: {str(trouble)[:300]}")

    def step(self):
        """From here on `late` asks whether the machine let us and the daemon run."""
        self.since, self.before = time.monotonic(), waited(self.processes())

    def processes(self):
        return [os.getpid(), *([self.daemon.process.pid] if self.daemon.process else [])]

    def late(self, sentence):
        """Wrong, unless a thread waited for a core for a third of the step: then it says nothing of the daemon."""
        waits = (ns - self.before.get(thread, 0) for thread, ns in waited(self.processes()).items())
        if 1e-9 * max(waits, default=0) < (time.monotonic() - self.since) / 3:
            self.wrong(sentence)
        else:
            self.counts["undecided"] += 1

    def kill(self, witness):
        self.daemon.kill()
        self.counts["kills"] += 1
        end = time.monotonic() + 5
        while not witness.closed and time.monotonic() < end:
            time.sleep(0.005)  # what was sent before the kill is still read

    def kill_at_start(self):
        """While it starts, recovers, or has just done so."""
        self.daemon.process = subprocess.Popen(self.daemon.command(), stderr=self.daemon.log,
                                               stdout=self.daemon.log)
        time.sleep(0.15 * self.random.random())
        self.daemon.kill()
        self.counts["kills"] += 1

    def await_recovery(self):
        """A thread named "recovery" checks what the earlier daemon left; a campaign is marked by then."""
        end = time.monotonic() + 20
        while "recovery" in freeze.threads(self.daemon.process.pid) or self.marked_running():
            if time.monotonic() > end:
                raise AssertionError("20 s after a start a campaign is still called running")
            time.sleep(0.01)

    def marked_running(self):
        for file in self.daemon.databases():
            with contextlib.suppress(sqlite3.Error), contextlib.closing(
                    sqlite3.connect(f"file:{file}?mode=ro", uri=True, timeout=5)) as database:
                if database.execute("SELECT status FROM campaign").fetchone() == ("running",):
                    return True
        return False

    def compare(self, witness):
        acknowledged = witness.acknowledged()
        files = self.daemon.databases()
        for kind in ("cycle", "estimate"):
            found = sum(line["type"] == kind for line, _ in acknowledged)
            self.counts[kind + "s"] += found
            self.counts["acknowledged"] += found
        lost = missing(acknowledged, files)
        self.counts["lost"] += len(lost)
        self.sentences += lost[:3]
        for file in files:
            if (said := integrity(file)) != "ok":
                self.wrong(f"{file.name}: {said}")

    def wrong(self, sentence):
        self.counts["wrong"] += 1
        self.sentences.append(sentence)

    def clear(self):
        """What was compared; the daemon that recovered it has let it go."""
        for file in self.daemon.data.glob("*"):
            file.unlink(missing_ok=True)


def work(task):
    seed, lives = task
    life = Lives(seed)
    try:
        for _ in range(lives):
            life.live()
    finally:
        life.daemon.end()
    return seed, life.counts, life.sentences


def run(options):
    sums, began, line = dict.fromkeys(COUNTED, 0), time.monotonic(), Progress()
    end = began + 60 * options.minutes if options.minutes else float("inf")
    ignore = signal.signal(signal.SIGINT, signal.SIG_IGN)
    tempfile.tempdir = memory()
    with multiprocessing.get_context("fork").Pool(options.parallel, end_with_parent) as workers:
        signal.signal(signal.SIGINT, ignore)
        waiting, number = [], options.first
        lives = min(5, max(1, options.count // options.parallel))
        try:
            while waiting or (sums["kills"] < options.count and time.monotonic() < end):
                while (len(waiting) < options.parallel and sums["kills"] < options.count
                       and time.monotonic() < end):
                    waiting.append(workers.apply_async(work, ((f"{options.seed}:{number}", lives),)))
                    number += 1
                for done in [w for w in waiting if w.ready()]:
                    waiting.remove(done)
                    seed, counts, sentences = done.get()
                    sums = {key: sums[key] + counts[key] for key in COUNTED}
                    for sentence in sentences:
                        print(f"\nlives {seed}: VIOLATED: {sentence}")
                    line.show(progress(sums, began))
                time.sleep(0.05)
        except KeyboardInterrupt:
            print("\nended by hand; what was done is counted")
    return sums, began


def progress(sums, began):
    minutes = (time.monotonic() - began) / 60
    return (f"{sums['kills']} kills, {sums['acknowledged']} acknowledged ({sums['cycles']} cycles, "
            f"{sums['estimates']} estimates), {sums['lost']} lost, {sums['wrong']} otherwise wrong, "
            f"{sums['undecided']} undecided, {sums['kills'] / minutes:.0f} kills a minute")


def main():
    parse = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parse.add_argument("--count", type=int, default=100, help="kills, or a few more")
    parse.add_argument("--minutes", type=float, help="begin no life after so long")
    parse.add_argument("--seed", default="1")
    parse.add_argument("--first", type=int, default=0, help="number of the first lives, five at a time")
    parse.add_argument("--parallel", type=int, default=4, help="daemons at once")
    parse.add_argument("--keep", action="store_true", help="add the counts to docs/soak")
    options = parse.parse_args()
    page = ledger.Page("kills") if options.keep else None
    sums, began = run(options)
    print("\n" + progress(sums, began))
    if page:
        print(page.keep({"seed": options.seed, **sums}))
    return 1 if sums["lost"] or sums["wrong"] or not sums["kills"] else 0


if __name__ == "__main__":
    sys.exit(main())
