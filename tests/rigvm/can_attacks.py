"""A rig whose drive and sensors are all on one CAN bus, and what other nodes and a broken bus do to it. Two
observers: the virtual rig's registers by Modbus, and every setpoint frame by a raw socket. After each attack the
table must be at rest within a bound, one error alarm must say why, and nothing may move by itself."""
import json
import os
import re
import signal
import socket
import struct
import subprocess
import sys
import threading
import time

from guest import expect, run, step

os.environ |= {"SHAKERD": "/srv/rigvm/shakerd", "SHAKER_SOURCE": "/srv/rigvm", "TMPDIR": "/run"}
from daemon import CAMPAIGN, Client, Daemon  # noqa: E402  (it reads the environment)
from observer import Observer  # noqa: E402

LINK, PORT = "vcan0", 1502
SETPOINT, STATUS, STROKE = 256, 257, 385  # identifiers: sim/oleosim.dbc
ERROR, BUS_OFF = 0x20000000, 0x40         # linux/can.h, linux/can/error.h
FREQUENCY_HZ, AMPLITUDE, DEADMAN_S = 5.0, 3.0, 0.6
NO_QUEUE = ("tc", "qdisc", "del", "dev", LINK, "root")

RIG = {
    "format": "shaker-rig/1", "name": "all on CAN",
    "exciter": {"ramp_s": 0.2, "heartbeat_period_s": 0.15, "device": {
        "kind": "can", "interface": LINK, "dbc": "oleosim.dbc", "setpoint_message": "SETPOINT",
        "status_message": "STATUS", "period_s": 0.02}},
    "sensors": [{"kind": "can", "interface": LINK, "dbc": "oleosim.dbc", "signals": [
        {"channel": "displacement", "message": "STROKE", "signal": "position"},
        {"channel": "excitation", "message": "TABLE", "signal": "acceleration"}]}],
    # This machine has one slow CPU that it shares with whatever else the host does.
    "limits": {"stroke_min_m": 0.0, "stroke_max_m": 0.186, "stale_s": 0.5, "engine_stall_s": 2.0,
               "acquisition_stall_s": 5.0, "recorder_stall_s": 10.0}}


class Bus(threading.Thread):
    """Another node. What it sends itself it does not see: `orders` are the daemon's setpoints that command motion."""

    def __init__(self):
        super().__init__(daemon=True)
        self.orders = []
        self.open()
        self.start()

    def open(self):
        self.wire = socket.socket(socket.PF_CAN, socket.SOCK_RAW, socket.CAN_RAW)
        self.wire.setsockopt(socket.SOL_CAN_RAW, socket.CAN_RAW_FILTER, struct.pack("=II", SETPOINT, 0x7FF))
        self.wire.bind((LINK,))

    def run(self):
        while True:
            try:
                _, length, data = struct.unpack("=IB3x8s", self.wire.recv(16))
            except OSError:  # the link is down, or gone
                time.sleep(0.05)
                continue
            if length == 8 and data[4] & 1 and struct.unpack_from("<H", data, 2)[0]:
                self.orders.append(time.monotonic())

    def send(self, identifier, data):
        self.wire.send(struct.pack("=IB3x8s", identifier, len(data), data))


def setpoint(amplitude, beat):
    return struct.pack("<HHBBH", int(FREQUENCY_HZ * 1000), int(amplitude * 1000), 1, 2, beat & 0xFFFF)


def status(flags, fault, frequency_hz, amplitude):
    return struct.pack("<HHHH", flags, fault, int(frequency_hz * 1000), int(amplitude * 1000))


class Stand:
    def __init__(self):
        self.rig = subprocess.Popen(["/srv/rigvm/oleosim", "--port", str(PORT), "--can", LINK, "--rate", "250",
                                     "--heartbeat-timeout", str(DEADMAN_S)], stdout=subprocess.PIPE, text=True)
        expect(self.rig.stdout.readline().startswith("ready"), "the virtual rig does not start")
        self.bus = Bus()
        self.table = Observer(PORT)
        self.daemon = Daemon(RIG)
        run("cp", "/srv/rigvm/oleosim.dbc", str(self.daemon.directory))
        self.daemon.start()
        self.client = Client(self.daemon.socket)
        self.campaign = CAMPAIGN | {"name": "attacked", "ramp_s": 0.2, "points_per_cycle": 8, "runs": [
            {"name": "dwell", "frequency_hz": FREQUENCY_HZ, "amplitude": AMPLITUDE, "cycles": 10000}]}

    def wait(self, seconds, probe=lambda: False):
        """True when probe() was true within that time; the lease is renewed meanwhile."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            if probe():
                return True
            if time.monotonic() - self.client.renewed > 0.5:
                self.client.send({"jsonrpc": "2.0", "method": "lease.renew"})
                self.client.renewed = time.monotonic()
            self.client.read(0.02)
        return probe()

    def state(self):
        states = self.client.of_type("state")
        return states[-1]["state"] if states else None

    def at_rest(self):
        last = self.table.last()
        return last is not None and time.monotonic() - last.t < 0.5 and not last.moves

    def until_it_moves(self, again=5):
        """Where this machine was held up for longer than the dead-man, which is no fault of ours: again."""
        for answer in (self.client.ask("control.acquire"),
                       self.client.ask("campaign.start", {"campaign": self.campaign})):
            expect("result" in answer, f"the campaign does not start: {answer}")
        began = len(self.client.lines)
        moves = self.wait(25, lambda: any(line.get("type") == "state" and line["state"] == "SETTLE"
                                          for line in self.client.lines[began:]))
        late = any(line.get("code") == "heartbeat_late" for line in self.client.lines[began:])
        if not moves and late and again > 0:
            step("  this machine was held up; again")
            self.acknowledge()
            return self.until_it_moves(again - 1)
        return expect(moves and not self.at_rest(), f"the campaign does not move the table: {self.tail()}")

    def tail(self):
        told = [line for line in self.client.lines if line.get("type") in ("state", "alarm")]
        return "\n".join(json.dumps(line) for line in told[-12:])

    def acknowledge(self):
        """FAULT is left as soon as its cause is gone."""
        def done():
            return self.state() == "IDLE" or "result" in self.client.ask("ack")
        expect(self.wait(15, done) and self.wait(5, lambda: self.state() == "IDLE"),
               f"the fault cannot be acknowledged: {self.client.ask('ack')}\n{self.tail()}")


def sends(stand, identifier, data_of, seconds=1.0):
    """Another node sends every 20 ms for so long."""
    for i in range(int(seconds / 0.02)):
        stand.bus.send(identifier, data_of(i))
        stand.wait(0.015)


def commanded_by_another(stand):
    sends(stand, SETPOINT, lambda i: setpoint(4.0, 40000 + i))


def status_of_another(stand):
    sends(stand, STATUS, lambda i: status(3, 0, 2 * FREQUENCY_HZ, AMPLITUDE), 2.0)


def trip_of_another(stand):
    sends(stand, STATUS, lambda i: status(0, 2, 0, 0), 0.3)


def cut_status(stand):
    sends(stand, STATUS, lambda i: b"\x03\x00", 0.3)


def stroke_of_another(stand):
    """A stroke beyond its limits, longer than the one wild sample that is allowed."""
    for _ in range(20):
        for _ in range(4):
            stand.bus.send(STROKE, struct.pack("<fHB", 0.5, 0, 0))
        stand.wait(0.015)


def bus_off(stand):
    stand.bus.send(ERROR | BUS_OFF, bytes(8))


def bus_is_full(stand):
    """A node that babbles with a higher priority: nobody else's frames get onto the bus."""
    run("tc", "qdisc", "add", "dev", LINK, "root", "netem", "limit", "1", "delay", "100s")
    stand.wait(1.5)
    run(*NO_QUEUE)


def setpoints_are_late(stand):
    stand.daemon.process.send_signal(signal.SIGSTOP)
    time.sleep(1.5)
    stand.daemon.process.send_signal(signal.SIGCONT)


def link_down(stand):
    run("ip", "link", "set", LINK, "down")
    stand.wait(1.0)
    run("ip", "link", "set", LINK, "up")


def link_deleted(stand):
    run("ip", "link", "del", LINK)
    stand.wait(1.0)
    run("ip", "link", "add", "dev", LINK, "type", "vcan")
    run("ip", "link", "set", LINK, "up")
    stand.bus.open()


# What it is, how long the table may move after it began (s; the attack itself included where it is what moves the
# table), and what the error alarm must say.
ATTACKS = [
    (commanded_by_another, 1.0 + DEADMAN_S, "another node sends SETPOINT"),
    (status_of_another, 2.0, "the exciter reports 10 Hz, asked for 5 Hz|STATUS comes much more often"),
    (trip_of_another, 0.5, "tripped with fault 2"),
    (cut_status, 1.0, "came with 2 bytes, expected 8.*no other node"),
    (stroke_of_another, 0.5, "stroke"),
    (bus_off, DEADMAN_S, "bus-off"),
    (bus_is_full, 2 * DEADMAN_S, "onto the bus|no good (sample|value)|older than|silent"),
    (setpoints_are_late, DEADMAN_S, "no heartbeat"),
    (link_down, DEADMAN_S, f"{LINK} is down"),
    (link_deleted, DEADMAN_S, f"{LINK} is (gone|down)|no interface {LINK}"),
]
SLACK_S = 0.6  # of a slow machine


def attacked(stand, attack, bound, says, again=3):
    """Where this machine was held up for longer than the dead-man during the attack: again."""
    stand.until_it_moves()
    told = len(stand.client.lines)
    began = time.monotonic()
    attack(stand)
    expect(stand.wait(8, stand.at_rest), f"{attack.__name__}: the table does not come to rest\n{stand.tail()}")
    stand.wait(6, lambda: stand.state() in ("FAULT", "IDLE"))
    moved = [r.t for r in stand.table.moving(began)]
    took = moved[-1] - began if moved else 0.0
    late = stand.table.lateness(began, began + bound)
    quiet = time.monotonic()
    stand.wait(0.6)
    alarms = [line for line in stand.client.lines[told:] if line.get("type") == "alarm"]
    if again > 0 and attack is not setpoints_are_late and any(a["code"] == "heartbeat_late" for a in alarms):
        step(f"  {attack.__name__}: this machine was held up; again")
        stand.acknowledge()
        return attacked(stand, attack, bound, says, again - 1)
    # That the table may still move is said as long as another node moves it.
    errors = [a for a in alarms if a["severity"] == "error" and a["code"] != "stop_not_obeyed"]
    said = " | ".join(f"{a['code']}: {a['text']}" for a in errors)
    step(f"  {attack.__name__}: {took:.2f} s, {stand.state()}; {said}")
    expect(took <= bound + SLACK_S + late, f"the table moved for {took:.2f} s; {bound} s are allowed\n{stand.tail()}")
    expect(len(errors) == 1, f"{len(errors)} error alarms instead of one\n{stand.tail()}")
    expect(re.search(says, errors[0]["text"]), f"the alarm does not say {says!r}\n{stand.tail()}")
    expect(not stand.table.moving(quiet), "the table moves again by itself")
    expect(not [t for t in stand.bus.orders if t > quiet], "the daemon commands motion again by itself")
    stand.acknowledge()


def commanded_at_rest(stand):
    step("in IDLE another node commands the drive: said, and told to stop")
    told, began = len(stand.client.lines), time.monotonic()
    sends(stand, SETPOINT, lambda i: setpoint(3.0, 50000 + i), 1.5)
    expect(stand.wait(3, stand.at_rest), f"the table does not come to rest\n{stand.tail()}")
    alarms = [line for line in stand.client.lines[told:] if line.get("type") == "alarm"]
    said = " | ".join(f"{a['severity']} {a['code']}: {a['text']}" for a in alarms)
    step("  " + said)
    expect("another node sends SETPOINT" in said, "nobody said that another node commands the drive")
    expect(any(a["severity"] == "error" for a in alarms) and stand.state() == "FAULT",
           "the table was moved in IDLE without an error alarm")
    expect(not [t for t in stand.bus.orders if t > began], "the daemon commanded motion")
    stand.acknowledge()


def main():
    stand = Stand()
    only = sys.argv[1:]
    for attack, bound, says in ATTACKS:
        if not only or attack.__name__ in only:
            attacked(stand, attack, bound, says)
    commanded_at_rest(stand)
    step("done")


try:
    main()
finally:
    run("sh", "-c", "cp /run/shakerd.*/log /srv/rigvm/out/shakerd.log", check=False)
