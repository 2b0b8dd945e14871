"""What a sensor says that is not so: a rule for unit 2 that changes stroke and excitation."""
import math
import random
import time

import modbus_wire as modbus
from proxy import Rule


class Sensor(Rule):
    """`stroke` and `excitation` map a value to another; None leaves it."""

    def __init__(self, stroke=None, excitation=None):
        self.changes = [(modbus.DISPLACEMENT, stroke), (modbus.EXCITATION, excitation)]

    def answer(self, request, answer):
        if request.is_write or request.unit != modbus.SENSORS or answer.is_exception:
            return answer
        first, count = request.read_range()
        words = answer.read_words()
        for register, change in self.changes:
            at = register - first
            if change is not None and 0 <= at and at + 2 <= count:
                words[at:at + 2] = modbus.f32_words(change(modbus.f32(words[at:at + 2])))
        return answer.with_read_words(words)


class Frozen:
    """The value of the first call, for good."""

    def __init__(self):
        self.value = None

    def __call__(self, value):
        if self.value is None:
            self.value = value
        return self.value


class StuckButNoisy(Frozen):
    """A core that has come loose: the stroke of the first call, with the sensor's noise."""

    def __init__(self, seed, noise_m=20e-6):
        super().__init__()
        self.random = random.Random(seed)
        self.noise_m = noise_m

    def __call__(self, value):
        return super().__call__(value) + self.random.gauss(0.0, self.noise_m)


class SpikeEachCycle:
    """One sample a period lies a metre off."""

    def __init__(self, period_s):
        self.period_s = period_s
        self.due = 0.0

    def __call__(self, value):
        now = time.monotonic()
        if now < self.due:
            return value
        self.due = now + self.period_s
        return value + 1.0


class ScaledAboutItsMiddle:
    """Gain changes about the middle of the stroke, so that the level at rest says nothing."""

    def __init__(self, gain):
        self.gain = gain
        self.middle = None

    def __call__(self, value):
        self.middle = value if self.middle is None else self.middle + 0.005 * (value - self.middle)
        return self.middle + self.gain * (value - self.middle)


class RepeatedBlock(Rule):
    """A gateway that repeats its last answer, time stamp and all."""

    def __init__(self):
        self.pdu = None

    def answer(self, request, answer):
        if request.unit != modbus.SENSORS:
            return answer
        self.pdu = self.pdu or answer.pdu
        return answer.with_pdu(self.pdu)


def not_a_number(_):
    return math.nan
