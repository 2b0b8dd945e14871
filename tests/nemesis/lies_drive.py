"""What a drive does that does not do what it says."""
import threading
import time

import modbus_wire as modbus
from proxy import Rule


def is_stop(request):
    """Enable 0, or amplitude 0, is among what is written."""
    if not request.is_write:
        return False
    words = request.written()
    return words.get(modbus.ENABLE) == 0 or (
        modbus.AMPLITUDE in words and words[modbus.AMPLITUDE] == 0
        and words.get(modbus.AMPLITUDE + 1) == 0)


class RefusesStop(Rule):
    """Exception 4 to a stop, and nothing done."""

    def reply(self, request):
        return request.exception(4) if is_stop(request) else None


class IgnoresStop(Rule):
    """A stop is acknowledged and not done; what was written reads back. `lies`: the status says rest."""

    def __init__(self, lies):
        self.lies = lies
        self.shadow = {}

    def reply(self, request):
        if not is_stop(request):
            return None
        self.shadow.update(request.written())
        return request.write_answer()

    def answer(self, request, answer):
        if request.is_write or answer.is_exception or not self.shadow:
            return answer
        first, count = request.read_range()
        words = answer.read_words()
        if request.function == modbus.READ_HOLDING:
            words = [self.shadow.get(first + i, word) for i, word in enumerate(words)]
        elif self.lies and request.unit == modbus.CONTROLLER:
            for i in range(count):
                if first + i == modbus.STATUS:
                    words[i] &= ~modbus.RUNNING
                if first + i in (modbus.AMPLITUDE_NOW, modbus.AMPLITUDE_NOW + 1):
                    words[i] = 0
        return answer.with_read_words(words)


class Rewrites(Rule):
    """A 32-bit setpoint goes to the rig changed and reads back as written. `said`: what the drive says of itself
    where it is `actual` and was `told`; None: it admits what it does."""

    def __init__(self, register, actual, change, back, said):
        self.register, self.actual = register, actual
        self.change, self.back, self.said = change, back, said
        self.told = 0.0

    def request(self, request):
        if not request.is_write:
            return request
        words = request.written()
        if self.register not in words or self.register + 1 not in words:
            return request
        self.told = modbus.f32((words[self.register], words[self.register + 1]))
        changed = modbus.f32_words(self.change(self.told))
        words[self.register], words[self.register + 1] = changed
        return request.with_written(words)

    def answer(self, request, answer):
        if request.is_write or answer.is_exception:
            return answer
        first, count = request.read_range()
        holding = request.function == modbus.READ_HOLDING
        if not holding and not (self.said and request.unit == modbus.CONTROLLER):
            return answer
        at = (self.register if holding else self.actual) - first
        if at < 0 or at + 2 > count:
            return answer
        words = answer.read_words()
        value = modbus.f32(words[at:at + 2])
        words[at:at + 2] = modbus.f32_words(self.back(value) if holding else self.said(value, self.told))
        return answer.with_read_words(words)


def doubled_amplitude(hides):
    """The table takes a moment from one amplitude to the next. What hides that follows it on the way."""
    return Rewrites(modbus.AMPLITUDE, modbus.AMPLITUDE_NOW, lambda a: 2 * a, lambda a: a / 2,
                    (lambda a, told: max(a / 2, min(a, told))) if hides else None)


def other_frequency(times, hides):
    return Rewrites(modbus.FREQUENCY, modbus.FREQUENCY_NOW, lambda f: times * f, lambda f: f / times,
                    (lambda f, told: told) if hides else None)


class DeadManThatDoesNotWork(threading.Thread):
    """Beats in the daemon's place, so that the rig goes on whatever the daemon withholds."""

    def __init__(self, rig_port):
        super().__init__(daemon=True)
        self.wire = modbus.Wire(rig_port)
        self.ended = threading.Event()
        self.start()

    def run(self):
        count = 40000  # above all that the daemon sends
        while not self.ended.wait(0.05):
            count = 40000 + (count + 1) % 20000
            try:
                self.wire.write(modbus.HEARTBEAT, [count])
            except OSError:
                return

    def end(self):
        self.ended.set()
        self.join(5)
        self.wire.close()


def write_past_the_daemon(rig_port, register, value):
    wire = modbus.Wire(rig_port)
    wire.write(register, modbus.f32_words(value))
    wire.close()


def inject(rig_port, number):
    """One of the rig's own faults."""
    wire = modbus.Wire(rig_port)
    wire.write(modbus.INJECT, [number])

    def lift():
        try:
            wire.write(modbus.INJECT, [0])
        except OSError:
            pass  # the rig has gone meanwhile
        wire.close()
    return lift


def stop_past_the_daemon(rig_port):
    """The hardware stop of a table that nothing else stops."""
    wire = modbus.Wire(rig_port)
    wire.write(modbus.ENABLE, [0])
    time.sleep(0.05)
    wire.close()
