"""Modbus TCP by hand: frames, a client of a few lines, and the virtual rig's registers (sim/README.md).

It shares no code with the daemon's driver, nor with the rig's server: it is what the observer trusts.
"""
import socket
import struct
from dataclasses import dataclass, replace

CONTROLLER, SENSORS = 1, 2  # unit ids
READ_HOLDING, READ_INPUT, WRITE_ONE, WRITE_MANY = 3, 4, 6, 16
# Holding registers of the controller.
FREQUENCY, AMPLITUDE, ENABLE, RAMP, HEARTBEAT, INJECT = 0, 2, 4, 5, 7, 11
# Input registers, of both units.
STATUS, FAULT, FREQUENCY_NOW, AMPLITUDE_NOW, DISPLACEMENT, EXCITATION = 0, 1, 2, 4, 6, 8
RUNNING = 1
# Numbers of the rig's own faults.
EXCITER_TRIP, EXCITER_DEAF = 5, 6


def f32_words(value):
    return list(struct.unpack(">HH", struct.pack(">f", value)))


def f32(words):
    return struct.unpack(">f", struct.pack(">HH", *words))[0]


@dataclass(frozen=True)
class Frame:
    transaction: int
    unit: int
    pdu: bytes

    def encode(self):
        return struct.pack(">HHHB", self.transaction, 0, len(self.pdu) + 1, self.unit) + self.pdu

    def with_pdu(self, pdu):
        return replace(self, pdu=bytes(pdu))

    @property
    def function(self):
        return self.pdu[0]

    @property
    def address(self):
        """Of a request."""
        return struct.unpack(">H", self.pdu[1:3])[0]

    @property
    def is_write(self):
        return self.function in (WRITE_ONE, WRITE_MANY)

    def read_range(self):
        """(address, count) of a request to read."""
        return struct.unpack(">HH", self.pdu[1:5])

    def written(self):
        """{address: word} of a request to write."""
        if self.function == WRITE_ONE:
            return {self.address: struct.unpack(">H", self.pdu[3:5])[0]}
        count = struct.unpack(">H", self.pdu[3:5])[0]
        words = struct.unpack(f">{count}H", self.pdu[6:6 + 2 * count])
        return {self.address + i: word for i, word in enumerate(words)}

    def with_written(self, values):
        """The same request to write, with other words."""
        if self.function == WRITE_ONE:
            return self.with_pdu(struct.pack(">BHH", WRITE_ONE, self.address, values[self.address]))
        words = [values[address] for address in sorted(values)]
        return self.with_pdu(self.pdu[:6] + struct.pack(f">{len(words)}H", *words))

    def write_answer(self):
        """What a device says that has done this request to write."""
        return self.with_pdu(self.pdu[:5])

    def exception(self, code):
        return self.with_pdu(bytes([self.function | 0x80, code]))

    def read_words(self):
        """The words of an answer to a request to read."""
        return list(struct.unpack(f">{self.pdu[1] // 2}H", self.pdu[2:2 + self.pdu[1]]))

    def with_read_words(self, words):
        return self.with_pdu(self.pdu[:2] + struct.pack(f">{len(words)}H", *words))

    @property
    def is_exception(self):
        return self.function & 0x80 != 0


def receive(link):
    """The next frame of a socket; None at its end. A timeout in mid-frame is an OSError like any other."""
    def exactly(count):
        data = b""
        while len(data) < count:
            more = link.recv(count - len(data))
            if not more:
                return None
            data += more
        return data

    head = exactly(7)
    if head is None:
        return None
    transaction, _, length, unit = struct.unpack(">HHHB", head)
    pdu = exactly(length - 1)
    return None if pdu is None else Frame(transaction, unit, pdu)


class Wire:
    """A client: one request, one answer. OSError when there is none."""

    def __init__(self, port, timeout=0.5):
        self.link = socket.create_connection(("127.0.0.1", port), timeout)
        self.link.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self.transaction = 0

    def close(self):
        self.link.close()

    def ask(self, unit, pdu):
        self.transaction = (self.transaction + 1) & 0xFFFF
        self.link.sendall(Frame(self.transaction, unit, pdu).encode())
        while (answer := receive(self.link)) is not None:
            if answer.transaction == self.transaction:
                return answer
        raise ConnectionError("the rig has closed the connection")

    def read(self, address, count, unit=CONTROLLER, function=READ_INPUT):
        answer = self.ask(unit, struct.pack(">BHH", function, address, count))
        if answer.is_exception:
            raise OSError(f"exception {answer.pdu[1]}")
        return answer.read_words()

    def write(self, address, words):
        count = len(words)
        answer = self.ask(CONTROLLER, struct.pack(f">BHHB{count}H", WRITE_MANY, address, count,
                                                  2 * count, *words))
        if answer.is_exception:
            raise OSError(f"exception {answer.pdu[1]}")
