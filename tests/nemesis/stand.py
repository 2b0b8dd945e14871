"""A test stand: the virtual rig, two proxies, the daemon, and who watches them, in one folder."""
import contextlib
import json
import os
import pathlib
import shutil
import signal
import subprocess
import time

from daemon import CAMPAIGN, Daemon

from crowd import DIES_WITH_US
from observer import Observer
from proxy import Proxy
from shim import Shim
from witness import Witness, kept_in

FREQUENCY_HZ, AMPLITUDE, RAMP_S, DEADMAN_S = 5.0, 3.0, 0.3, 0.5
STALE_S, ANSWER_S = 0.5, 0.25


def registers(measured):
    f32 = {"type": "f32"}
    found = {"displacement": {"table": "input", "address": 6, "unit": "m", **f32},
             "excitation": {"table": "input", "address": 8, "unit": "m/s^2", **f32},
             "timestamp": {"table": "input", "address": 10, "type": "u32", "unit": "us"}}
    if not measured:  # a hole between registers is no one request, so that the stamp goes too
        del found["excitation"], found["timestamp"]
    return found


def rig_file(exciter_port, sensor_port, measured=True):
    def link(port, unit):
        # A machine that runs several tests keeps a proxy waiting: slower than a real wire may be.
        return {"transport": {"kind": "tcp", "host": "127.0.0.1", "port": port}, "unit_id": unit,
                "response_timeout_s": ANSWER_S}
    example = {
        "frequency": {"address": 0, "type": "f32", "unit": "Hz"},
        "amplitude": {"address": 2, "type": "f32", "unit": "m/s^2"},
        "enable": {"address": 4, "type": "u16"},
        "ramp": {"address": 5, "type": "f32", "unit": "s"},
        "heartbeat": {"address": 7, "type": "u16", "cyclic": True},
        "heartbeat_timeout": {"address": 8, "type": "f32", "unit": "s"},
        "fault_reset": {"address": 10, "type": "u16"},
        "status": {"table": "input", "address": 0, "type": "u16"},
        "fault": {"table": "input", "address": 1, "type": "u16"},
        "frequency_actual": {"table": "input", "address": 2, "type": "f32", "unit": "Hz"},
        "amplitude_actual": {"table": "input", "address": 4, "type": "f32", "unit": "m/s^2"}}
    return {
        "format": "shaker-rig/1", "name": "nemesis",
        "exciter": {"ramp_s": RAMP_S,
                    "device": {"kind": "modbus", "link": link(exciter_port, 1), "registers": example}},
        "sensors": [{"kind": "modbus", "link": link(sensor_port, 2), "rate_hz": 200,
                     "registers": registers(measured)}],
        "limits": {"stroke_min_m": 0.0, "stroke_max_m": 0.186, "stale_s": STALE_S}}


def campaign(ramp_s=RAMP_S):
    return {**json.loads(json.dumps(CAMPAIGN)), "name": "nemesis", "ramp_s": ramp_s,
            "runs": [{"name": "long", "frequency_hz": FREQUENCY_HZ, "amplitude": AMPLITUDE,
                      "cycles": 100000}]}


class ShimmedDaemon(Daemon):
    environment = ()

    def command(self, *words):
        return [*DIES_WITH_US, "/usr/bin/env", *self.environment, *super().command(*words)]


class Stand:
    def __init__(self, seed, library, dead_man_s=DEADMAN_S, measured=True, ramp_s=RAMP_S):
        self.seed, self.ramp_s = seed, ramp_s
        self.left = ""  # how a fault made the daemon leave: "killed", or "asked to end"
        self.excused = set()  # databases that a fault took away
        self.damaged_log = None  # the octets that a daemon found when it started again
        self.readable = None  # documents that SQLite itself could read then
        self.reached = False  # the allocation or the call that had to fail
        self.witnesses = []
        with contextlib.ExitStack() as undo:
            self.daemon = ShimmedDaemon(tcp=0)
            undo.callback(self.daemon.end)
            self.folder = self.daemon.directory
            self.view = self.folder / "view.sock"  # for those who only look on
            self.daemon.more += ["--view-socket", str(self.view)]
            self.rig = self.start_rig(dead_man_s)
            undo.callback(self.end_rig)
            self.exciter, self.sensor = Proxy(self.rig_port), Proxy(self.rig_port)
            undo.callback(self.exciter.end)
            undo.callback(self.sensor.end)
            self.daemon.rig_file.write_text(
                json.dumps(rig_file(self.exciter.port, self.sensor.port, measured)))
            self.observer = Observer(self.rig_port, self.processes)
            undo.callback(self.observer.end)
            self.shim = Shim(library, self.folder, self.daemon.data)
            undo.callback(self.shim.lift)
            self.daemon.environment = self.shim.environment
            self.undo = undo.pop_all()

    def start_rig(self, dead_man_s):
        status = self.folder / "rig.status"
        self.rig_log = open(self.folder / "rig.log", "wb")
        rig = subprocess.Popen([*DIES_WITH_US, os.environ["OLEOSIM"], "--port", "0", "--status-file",
                                str(status), "--heartbeat-timeout", str(dead_man_s)],
                               stdout=self.rig_log, stderr=self.rig_log)
        end = time.monotonic() + 20
        while time.monotonic() < end and rig.poll() is None:
            with contextlib.suppress(OSError, ValueError, KeyError):
                self.rig_port = json.loads(status.read_text())["port"]
                return rig
            time.sleep(0.01)
        rig.kill()
        raise AssertionError("oleosim did not start: " + (self.folder / "rig.log").read_text())

    def end_rig(self):
        self.rig.send_signal(signal.SIGCONT)
        self.rig.kill()
        self.rig.wait()
        self.rig_log.close()

    def start_daemon(self):
        self.daemon.start()
        self.left = ""
        self.witnesses.append(Witness(self.daemon.socket))
        return self.witnesses[-1]

    def processes(self):
        return [p.pid for p in (self.rig, self.daemon.process) if p and p.poll() is None]

    def leaves(self, how):
        self.left = self.left if self.left == "killed" else how

    def start_again(self):
        """As systemd does, once all faults are lifted, if one of them made the daemon leave."""
        if not self.left:
            return
        status = self.daemon.process.wait(30)
        if self.left == "asked to end":
            assert status == 0, f"the daemon was asked to end, and ended with {status}"
        self.start_daemon()

    @property
    def witness(self):
        return self.witnesses[-1]

    @property
    def pid(self):
        return self.daemon.process.pid

    def begin_campaign(self):
        self.witness.start(campaign(self.ramp_s))

    def damage(self, octets):
        """Remembers a damaged log, and what of it is readable: from a copy, which may be changed."""
        copies = self.folder / "copies"
        shutil.copytree(self.daemon.data, copies)
        self.damaged_log = octets
        self.readable, _ = kept_in(copies.glob("*.db"))

    def watch_from_elsewhere(self):
        self.witnesses.append(Witness(self.daemon.socket))

    def tcp_port(self):
        """Where others may listen: what the process itself listens on."""
        own = {os.readlink(link)[8:-1] for link in pathlib.Path(f"/proc/{self.pid}/fd").iterdir()
               if os.path.islink(link) and os.readlink(link).startswith("socket:")}
        for line in pathlib.Path("/proc/net/tcp").read_text().splitlines()[1:]:
            words = line.split()
            if words[3] == "0A" and words[9] in own:
                return int(words[1].split(":")[1], 16)
        raise ConnectionError("the daemon listens on no TCP port")

    def shakerctl(self, word, timeout=10):
        """As an operator at another terminal: (status, what it said)."""
        try:
            done = subprocess.run([os.environ["SHAKERCTL"], word, "--socket", str(self.daemon.socket)],
                                  capture_output=True, text=True, timeout=timeout)
        except subprocess.TimeoutExpired:
            return -1, f"shakerctl {word} had not ended after {timeout} s"
        return done.returncode, done.stdout + done.stderr

    def close(self):
        for witness in self.witnesses:
            witness.close()
        if self.daemon.process and self.daemon.process.poll() is None:
            self.daemon.process.send_signal(signal.SIGCONT)
            self.daemon.kill()  # all that is asserted has been: a stop takes its time
        self.undo.close()
        self.shim.close()
