"""What a wire does to frames: it loses, delays, garbles and mislabels them."""
import random
import time
from dataclasses import replace

from proxy import Rule


class BlackHole(Rule):
    """Every request vanishes; the connection stays."""

    def request(self, request):
        return None


class OneLost(Rule):
    """One answer vanishes."""

    def __init__(self):
        self.lost = False

    def answer(self, request, answer):
        if self.lost:
            return answer
        self.lost = True
        return None


class Late(Rule):
    def __init__(self, seconds):
        self.seconds = seconds

    def answer(self, request, answer):
        time.sleep(self.seconds)
        return answer


class WrongTransaction(Rule):
    def answer(self, request, answer):
        return replace(answer, transaction=(answer.transaction + 77) & 0xFFFF)


class WrongUnit(Rule):
    def answer(self, request, answer):
        return replace(answer, unit=answer.unit + 5)


class Garbage(Rule):
    def __init__(self, seed):
        self.random = random.Random(seed)

    def octets(self, request, answer):
        return self.random.randbytes(len(answer.encode()))


class ShortFrames(Rule):
    """The length of the header is right, the payload is cut."""

    def octets(self, request, answer):
        return answer.encode()[:-2]


class Exceptions(Rule):
    """Every request is answered by a Modbus exception."""

    def __init__(self, code):
        self.code = code

    def reply(self, request):
        return request.exception(self.code)
