#!/usr/bin/python3
"""A long campaign at a high rate through the real daemon: is anything lost, does memory stay flat?

    bench/soak.py BIN_FOLDER [--minutes 10] [--rate 10000]

Starts `shakerd` on the simulated rig (displacement, excitation and auxiliary channels, eight
together), runs one long dwell over its socket, and reports every sample, overflow and missing
document, the resident memory over time, the share of a core and the latency. Status 0 when nothing was lost and memory grew by less than 10 %
after the first minute. Needs nothing but Python's own library.
"""
import argparse
import json
import os
import pathlib
import socket
import sqlite3
import statistics
import subprocess
import sys
import tempfile
import threading
import time


QUANTITIES = [("gas_pressure", "Pa"), ("oil_temperature", "degC"), ("damper_force", "N"),
              ("mass_acceleration", "m/s^2"), ("table_acceleration_2", "m/s^2"),
              ("table_velocity", "m/s"), ("table_position", "m"), ("stroke_velocity", "m/s")]


def resident_kib(pid: int) -> int:
    for line in pathlib.Path(f"/proc/{pid}/status").read_text().splitlines():
        if line.startswith("VmRSS:"):
            return int(line.split()[1])
    return 0


def cpu_seconds(pid: int) -> float:
    fields = pathlib.Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def main() -> int:
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("bin", type=pathlib.Path)
    options.add_argument("--minutes", type=float, default=10.0)
    options.add_argument("--rate", type=float, default=10000.0)
    options.add_argument("--channels", type=int, default=8, help="2 to 10")
    given = options.parse_args()

    auxiliary = {f"aux{i + 1}": quantity
                 for i, quantity in enumerate(QUANTITIES[:given.channels - 2])}
    with tempfile.TemporaryDirectory(prefix="shakerd-soak.") as folder:
        folder = pathlib.Path(folder)
        (folder / "rig.json").write_text(json.dumps({
            "name": "soak",
            "exciter": {"device": {"kind": "simulated"}, "ramp_s": 1.0},
            "sensors": [{"kind": "simulated", "rate_hz": given.rate, "auxiliary":
                         {channel: name for channel, (name, _) in auxiliary.items()}}],
            "auxiliary": {channel: {"name": name, "unit": unit}
                          for channel, (name, unit) in auxiliary.items()},
            "limits": {"stale_s": 1.0},
        }))
        model = {"name": "oleo", "effects": [{"effect": "orifice_damping"},
                                             {"effect": "gas_spring"}, {"effect": "gravity"}]}
        cycles = int(2.0 * 60.0 * given.minutes)
        campaign = {"name": "soak", "model": model,
                    "runs": [{"name": "long", "frequency_hz": 2.0, "amplitude": 3.0,
                              "cycles": cycles}]}
        daemon = subprocess.Popen([given.bin / "shakerd", "--rig", folder / "rig.json", "--socket",
                                   folder / "s", "--data", folder],
                                  stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        try:
            return watch(daemon, folder, campaign, given)
        finally:
            daemon.terminate()
            daemon.wait(20)


def connected(path) -> socket.socket:
    stream = socket.socket(socket.AF_UNIX)
    for _ in range(100):
        try:
            stream.connect(str(path))
            break
        except OSError:
            time.sleep(0.1)
    return stream


class Tally:
    """What the stream said up to the end of the run."""

    def __init__(self, pid: int):
        self.pid, self.began = pid, time.monotonic()
        self.memory, self.latencies, self.newest = [], [], None
        self.gaps = self.accepted = self.estimates = 0
        self.health, self.stop = {}, None

    def count(self, document) -> None:
        kind = document.get("type")
        if kind in (None, "version"):
            return
        if self.newest is not None and document["seq"] > self.newest + 1:
            self.gaps += document["seq"] - self.newest - 1
        self.newest = max(self.newest or 0, document["seq"])
        if kind == "health":
            self.health = document
            self.memory.append((time.monotonic() - self.began, resident_kib(self.pid)))
        elif kind == "cycle":
            self.accepted += document["accepted"]
        elif kind == "estimate":
            self.estimates += 1
            self.latencies.append(document["latency_s"])
        elif kind == "run_stop":
            self.stop = document


def watch(daemon, folder, campaign, given) -> int:
    stream = connected(folder / "s")
    lines = stream.makefile("r")

    def ask(number, method, params=None):
        request = {"jsonrpc": "2.0", "id": number, "method": method, "params": params or {}}
        stream.sendall((json.dumps(request) + "\n").encode())

    ask(1, "control.acquire")
    ask(2, "campaign.start", {"campaign": campaign})
    tally, done = Tally(daemon.pid), threading.Event()

    def renew():  # apart from the reading, so that a slow line costs no lease
        while not done.wait(0.3):
            ask(3, "lease.renew")

    threading.Thread(target=renew, daemon=True).start()
    for text in lines:
        document = json.loads(text)
        if "error" in document:
            print(document["error"]["message"])
            return 1
        tally.count(document)
        if tally.stop:
            break
    done.set()
    length = time.monotonic() - tally.began
    share = cpu_seconds(daemon.pid) / length
    daemon.terminate()
    daemon.wait(20)
    return report(tally, given, length, share, next(folder.glob("soak_*.db")))


def report(tally, given, length, share, database) -> int:
    whole = sqlite3.connect(database).execute("PRAGMA integrity_check").fetchone()[0]
    health, stop = tally.health, tally.stop
    settled = [kib for second, kib in tally.memory if second > min(60.0, length / 2)]
    growth = settled[-1] / settled[0] - 1.0
    print(f"{given.rate:g} Hz x {given.channels} channels for {length / 60.0:.1f} min: run {stop['status']}")
    print(f"samples {health['samples']}, lost {health['lost']}, ring overflows "
          f"{health['ring_overflows']}, cycles skipped {health['cycles_skipped']}")
    print(f"cycles accepted {tally.accepted}, estimates {tally.estimates}, documents missing {tally.gaps}")
    print(f"memory {settled[0]} KiB -> {settled[-1]} KiB ({100.0 * growth:+.1f} %), "
          f"{100.0 * share:.0f} % of a core")
    print(f"latency median {1e3 * statistics.median(tally.latencies):.2f} ms, "
          f"worst {1e3 * max(tally.latencies):.2f} ms; database {database.stat().st_size >> 20} MiB, "
          f"integrity {whole}")
    good = (stop["status"] == "success" and not tally.gaps and tally.accepted == tally.estimates and
            health["lost"] == health["ring_overflows"] == 0 and growth < 0.1 and whole == "ok")
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
