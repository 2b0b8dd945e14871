"""A client that remembers what the daemon acknowledged, and compares it with the files afterwards."""
import sqlite3
import threading
import time

from daemon import Client

ACKNOWLEDGED = ("cycle", "estimate")  # docs/protocol.md: withheld when they cannot be kept


class Witness(Client):
    """Reads in a thread of its own, and renews the lease there once `start` was called."""

    def __init__(self, path):
        super().__init__(path)
        self.ended = threading.Event()
        self.hold_lease = True
        self.thread = threading.Thread(target=self.listen, daemon=True)
        self.thread.start()

    def listen(self):
        while not self.ended.is_set() and not self.closed:
            try:
                Client.read(self, 0.05)
                if self.renewing and self.hold_lease and time.monotonic() - self.renewed > 0.4:
                    self.send({"jsonrpc": "2.0", "method": "lease.renew"})
                    self.renewed = time.monotonic()
            except OSError:
                self.closed = True

    def read(self, timeout=0.05):
        """For `until`, which other threads call: the thread above reads."""
        time.sleep(0.01)

    def close(self):
        self.ended.set()
        self.thread.join(5)
        super().close()

    def seen(self):
        """Pairs (line, raw): a snapshot that other threads may walk."""
        count = len(self.times)  # appended last
        return list(zip(self.lines[:count], self.raw[:count]))

    def states(self):
        """[(time of the daemon's own stamp, s; state; reason)]: CLOCK_MONOTONIC is everyone's."""
        return [(line["t_mono_ns"] * 1e-9, line["state"], line["reason"]) for line, _ in self.seen()
                if line.get("type") == "state"]

    def alarms(self, since=0.0):
        return [line for line, _ in self.seen()
                if line.get("type") == "alarm" and line["t_mono_ns"] * 1e-9 >= since]

    def acknowledged(self):
        """[(line, raw)] of what came live, run_start among it: the snapshot repeats older ones."""
        lines = self.seen()
        newest = lines[0][0]["seq"] if lines else 0
        return [(line, raw) for line, raw in lines[1:] if line.get("seq", 0) > newest
                and line.get("type") in (*ACKNOWLEDGED, "run_start")]


def kept_in(files):
    """All lines of documents, and (campaign file, run, index) of accepted cycles, in these databases."""
    documents, cycles = set(), set()
    for file in files:
        try:
            database = sqlite3.connect(f"file:{file}?mode=ro", uri=True, timeout=5)
            try:
                documents.update(line for (line,) in database.execute("SELECT line FROM document"))
                cycles.update(database.execute("SELECT run, idx FROM cycle WHERE accepted"))
            finally:
                database.close()
        except sqlite3.Error:
            continue  # what is not a campaign holds nothing of one
    return documents, cycles


def missing(acknowledged, files):
    """What was acknowledged and is in none of the files: a sentence for each, empty when all is there."""
    documents, cycles = kept_in(files)
    runs, lost = {}, []
    for line, raw in acknowledged:
        if line["type"] == "run_start":
            runs[line["run"]] = line["run_index"]
        elif raw not in documents:
            lost.append(f"{line['type']} with seq {line['seq']} is in no file")
        elif line["type"] == "cycle" and line["accepted"]:
            place = (runs.get(line["run"], 0), line["cycle"])
            if place not in cycles:
                lost.append(f"cycle {line['cycle']} of run {line['run']} has its document, not its samples")
    return lost


def integrity(file):
    """SQLite's own word on a file."""
    database = sqlite3.connect(file, timeout=20)
    try:
        return database.execute("PRAGMA integrity_check").fetchone()[0]
    finally:
        database.close()
