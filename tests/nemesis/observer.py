"""What the table really does: the virtual rig's own registers, read past the daemon every 10 ms."""
import os
import pathlib
import threading
import time
from dataclasses import dataclass

import modbus_wire as modbus

PERIOD_S = 0.01
STILL = 0.02  # m/s^2; below is rest: the setpoint of a campaign here is a hundred times that


@dataclass(frozen=True)
class Reading:
    t: float  # monotonic, s
    running: bool
    frequency_hz: float
    amplitude: float

    @property
    def moves(self):
        return self.running and self.amplitude > STILL


LOOK_S = 0.1  # between two looks at who waits for a core
USUAL_S = 0.02  # of waiting in that time


def waited(pids):
    """{thread: ns for which it could run and waited for a core}, by the kernel's own count (schedstat)."""
    found = {}
    for pid in pids:
        try:
            for task in pathlib.Path(f"/proc/{pid}/task").iterdir():
                found[task.name] = int((task / "schedstat").read_text().split()[1])
        except (OSError, IndexError):
            continue  # it has ended, or this kernel does not count
    return found


class Queue:
    """How long threads that could run wait for a core."""

    def __init__(self):
        self.before = {}
        self.waits = []  # (t, s): by how much the thread that waited longest since the last look did so

    def look(self, pids):
        now = waited(pids)
        longest = max((ns - self.before.get(thread, ns) for thread, ns in now.items()), default=0)
        self.before = now
        self.waits.append((time.monotonic(), longest * 1e-9))

    def lateness(self, since, until):
        return sum(max(0.0, wait - USUAL_S) for t, wait in list(self.waits)
                   if since <= t <= until + LOOK_S)


class Observer(threading.Thread):
    """`readings` only grows; a gap in it is a rig that did not answer, or a machine that was busy.

    `others` gives the processes besides this one that must not be kept waiting. An observer that has died has seen
    nothing more: whoever asks it what moves gets its trouble.
    """

    trouble = None

    def __init__(self, port, others=lambda: ()):
        super().__init__(daemon=True)
        self.port, self.others = port, others
        self.queue = Queue()
        self.readings = []
        self.ended = threading.Event()
        self.start()

    def end(self):
        self.ended.set()
        self.join(5)

    def run(self):
        try:
            self.observe()
        except BaseException as trouble:
            self.trouble = trouble
            raise

    def observe(self):
        wire = None
        due = look = time.monotonic()
        while not self.ended.is_set():
            try:
                wire = wire or modbus.Wire(self.port)
                words = wire.read(0, 6)
                self.readings.append(Reading(
                    time.monotonic(), bool(words[modbus.STATUS] & modbus.RUNNING),
                    modbus.f32(words[modbus.FREQUENCY_NOW:][:2]),
                    modbus.f32(words[modbus.AMPLITUDE_NOW:][:2])))
            except OSError:
                if wire:
                    wire.close()
                wire = None
            if time.monotonic() >= look:
                self.queue.look([os.getpid(), *self.others()])
                look = time.monotonic() + LOOK_S
            due = max(due + PERIOD_S, time.monotonic() - PERIOD_S)
            time.sleep(max(0.0, due - time.monotonic()))
        if wire:
            wire.close()

    def moving(self, since, until=float("inf")):
        """The readings of a moving table in that span."""
        if self.trouble:
            raise RuntimeError("the observer has died") from self.trouble
        return [r for r in self.readings if since <= r.t <= until and r.moves]

    def last(self):
        return self.readings[-1] if self.readings else None

    def lateness(self, since, until):
        """By how much the machine kept us waiting: gaps beyond five periods, and waits for a core."""
        times = [r.t for r in list(self.readings)]
        if times and not self.ended.is_set():
            times.append(max(times[-1], min(until, time.monotonic())))
        gaps = sum(max(0.0, b - a - 5 * PERIOD_S) for a, b in zip(times, times[1:])
                   if b >= since and a <= until)
        return max(gaps, self.queue.lateness(since, until))
