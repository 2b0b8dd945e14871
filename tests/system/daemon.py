"""The real shakerd on a simulated rig, and a client that shares no code with it."""
import contextlib
import json
import os
import pathlib
import shutil
import signal
import socket
import sqlite3
import subprocess
import tempfile
import time

from jsonschema import Draft202012Validator, RefResolver

SHAKERD = os.environ["SHAKERD"]
SOURCE = pathlib.Path(os.environ["SHAKER_SOURCE"])

TRUTH = {"theta1": 16.6667, "theta2": 1.524, "theta3": 5.31496, "theta4": 1.0}

RIG = {
    "format": "shaker-rig/1",
    "name": "simulated",
    "exciter": {"device": {"kind": "simulated"}, "ramp_s": 0.5},
    "sensors": [{"kind": "simulated", "rate_hz": 1000, "plant": "oleo", "parameters": TRUTH,
                 "clock_offset_ppm": 50, "jitter_fraction": 0.05}],
    # A busy machine may keep the simulated sensor and the daemon waiting: not what these tests are about.
    "limits": {"stroke_min_m": 0.0, "stroke_max_m": 0.185, "stale_s": 0.5, "engine_stall_s": 2.0,
               "acquisition_stall_s": 5.0, "recorder_stall_s": 10.0},
}

CAMPAIGN = {
    "format": "shaker-campaign/1",
    "name": "two short runs",
    "model": {
        "name": "oleo",
        "effects": [
            {"effect": "orifice_damping", "parameters": {"theta1": {"start": 15.8}}},
            {"effect": "gas_spring", "parameters": {"theta2": {"start": 1.45}, "theta3": {"start": 5.05},
                                                    "theta4": {"start": 1.05}}},
            {"effect": "gravity"}],
    },
    "runs": [
        {"name": "slow", "frequency_hz": 2.0, "amplitude": 3.0, "cycles": 4},
        {"name": "fast", "frequency_hz": 3.0, "amplitude": 3.0, "cycles": 6}],
    "ramp_s": 0.5,
}


def endless_campaign():
    campaign = json.loads(json.dumps(CAMPAIGN))
    campaign["name"] = "endless"
    campaign["runs"] = [{"name": "long", "frequency_hz": 3.0, "amplitude": 3.0, "cycles": 10000}]
    return campaign


class Schemas:
    def __init__(self):
        files = (SOURCE / "protocol" / "schema").glob("*.schema.json")
        schemas = {path.name.removesuffix(".schema.json"): json.loads(path.read_text())
                   for path in files}
        store = {schema["$id"]: schema for schema in schemas.values()}
        self.by_type = {name: Draft202012Validator(schema, resolver=RefResolver(schema["$id"], schema, store))
                        for name, schema in schemas.items()}
        self.stream = self.by_type["stream"]

    def faults(self, line):
        """Why a line of the stream is not valid; empty when it is."""
        own = self.by_type.get(line.get("type", "rpc_response"))
        if own is None:
            return [f"no schema for {line.get('type')}"]
        return [error.message for error in own.iter_errors(line)] or (
            [] if self.stream.is_valid(line) else ["not one of the stream's kinds"])


class Client:
    """Every line is kept in `lines`, with the time it came in `times` (monotonic, ns)."""

    def __init__(self, path, patience=30.0):
        self.socket = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        self.connect(path, patience)
        self.lines, self.times, self.raw, self.rest = [], [], [], b""
        self.closed = False
        self.next_id = 0
        self.renewing = False
        self.renewed = 0.0

    def connect(self, path, patience):
        """A listener that stands still accepts nobody: with its queue full, a plain connect waits for good."""
        self.socket.settimeout(patience)
        end = time.monotonic() + patience
        while True:
            try:
                return self.socket.connect(str(path))
            except BlockingIOError:
                if time.monotonic() > end:
                    self.socket.close()
                    raise
                time.sleep(0.01)

    def close(self):
        self.socket.close()

    def send(self, data):
        self.socket.settimeout(30)  # not that of the last read
        self.socket.sendall(data if isinstance(data, bytes) else json.dumps(data).encode() + b"\n")

    def read(self, timeout=0.05):
        self.socket.settimeout(timeout)
        try:
            data = self.socket.recv(1 << 20)
        except TimeoutError:
            return
        except ConnectionResetError:
            data = b""
        now = time.monotonic_ns()
        self.closed = not data
        *whole, self.rest = (self.rest + data).split(b"\n")
        for line in whole:
            self.raw.append(line.decode())
            self.lines.append(json.loads(line))
            self.times.append(now)

    def until(self, wanted, timeout=30, start=0):
        """The first line from index `start` on for which wanted(line); the lease is renewed meanwhile."""
        end = time.monotonic() + timeout
        seen = start
        while True:
            for line in self.lines[seen:]:
                if wanted(line):
                    return line
            seen = len(self.lines)
            if self.closed or time.monotonic() > end:
                tail = "\n".join(raw[:300] for raw, line in zip(self.raw, self.lines)
                                 if line.get("type") != "health")[-6000:]
                raise AssertionError(f"{'closed' if self.closed else 'timeout'} after:\n{tail}")
            if self.renewing and time.monotonic() - self.renewed > 0.5:
                self.send({"jsonrpc": "2.0", "method": "lease.renew"})
                self.renewed = time.monotonic()
            self.read()

    def until_state(self, *states, start=0, timeout=30):
        return self.until(lambda line: line.get("type") == "state" and line["state"] in states,
                          timeout, start)

    def ask(self, method, params=None):
        """The whole answer, result or error."""
        self.next_id += 1
        request = {"jsonrpc": "2.0", "id": self.next_id, "method": method}
        if params is not None:
            request["params"] = params
        self.send(request)
        return self.until(lambda line: line.get("id") == request["id"] and "jsonrpc" in line, 10)

    def start(self, campaign):
        for answer in (self.ask("control.acquire"), self.ask("campaign.start", {"campaign": campaign})):
            assert "result" in answer, answer
        self.renewing = True

    def of_type(self, name):
        return [line for line in self.lines if line.get("type") == name]


class Program(subprocess.Popen):
    """A thread that ptrace has stopped is no end: Popen takes it for one, and hides it from the tracer."""

    def poll(self):
        if self.returncode is None:
            try:
                found = os.waitid(os.P_PID, self.pid, os.WEXITED | os.WNOHANG | os.WNOWAIT)
            except ChildProcessError:  # another thread has just waited for it, and keeps its status
                return super().poll()
            if found is None or found.si_code not in (os.CLD_EXITED, os.CLD_KILLED, os.CLD_DUMPED):
                return None
        return super().poll()


class Daemon:
    """shakerd in a directory of its own, removed at the end; may be started again in it."""

    def __init__(self, rig=None, **more):
        self.directory = pathlib.Path(tempfile.mkdtemp(prefix="shakerd."))
        self.rig_file = self.directory / "rig.json"
        self.rig_file.write_text(json.dumps(rig or RIG))
        self.socket = self.directory / "s.sock"
        self.data = self.directory / "data"
        self.more = [str(word) for pair in more.items() for word in (f"--{pair[0]}", pair[1])]
        self.process = None

    def command(self, *words):
        return [SHAKERD, "--rig", str(self.rig_file), "--socket", str(self.socket), "--data",
                str(self.data), *self.more, *words]

    def start(self):
        self.log = open(self.directory / "log", "ab")
        self.process = Program(self.command(), stderr=self.log, stdout=self.log)
        end = time.monotonic() + 20
        while time.monotonic() < end and self.process.poll() is None:
            with contextlib.suppress(OSError):
                client = Client(self.socket)
                client.close()
                return self
            time.sleep(0.02)
        raise AssertionError(f"shakerd did not start:\n{self.log_text()}")

    def log_text(self):
        return (self.directory / "log").read_text()

    def until_logged(self, text, timeout=20):
        """The daemon logs by a thread of its own: a line may be later than what it tells of."""
        end = time.monotonic() + timeout
        while text not in self.log_text():
            if time.monotonic() > end:
                raise AssertionError(f"{text!r} was not logged:\n{self.log_text()}")
            time.sleep(0.02)

    def kill(self):
        self.process.kill()
        self.process.wait()

    def end(self):
        if self.process and self.process.poll() is None:
            self.process.send_signal(signal.SIGTERM)
            try:
                self.process.wait(20)
            except subprocess.TimeoutExpired:
                self.kill()
        if self.process:
            self.log.close()
        shutil.rmtree(self.directory, ignore_errors=True)

    def databases(self):
        return sorted(self.data.glob("*.db"))

    def campaign_status(self):
        """Of the only campaign: the recorder closes its file a moment after the last document."""
        [file] = self.databases()
        end = time.monotonic() + 10
        while True:
            with contextlib.closing(sqlite3.connect(file)) as database:
                status, = database.execute("SELECT status FROM campaign").fetchone()
            if status != "running" or time.monotonic() > end:
                return status
            time.sleep(0.05)
