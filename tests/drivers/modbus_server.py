"""An exciter controller made of python3-pymodbus: an independent stand-in for the real one.

  modbus_server.py tcp [PORT]     listens on 127.0.0.1 (a free port when none is given)
  modbus_server.py rtu            makes a pseudo terminal

Prints one line, "ready PORT" or "ready /dev/pts/N", then obeys lines on standard input, each
answered with one line:

  get ADDRESS [COUNT]        the holding registers, in hexadecimal
  set ADDRESS WORD...        sets them (hexadecimal)
  input ADDRESS WORD...      sets input registers
  clamp ADDRESS WORD         what is written to this register becomes WORD
  exception CODE COUNT       answers the next COUNT requests with this exception
  exception_on FUNCTION CODE answers every request of this function so (0: no longer)
  delay MILLISECONDS COUNT   answers the next COUNT requests so late
  mute COUNT                 does not answer the next COUNT requests
  unit UNIT COUNT            answers the next COUNT requests as if it were this unit
  garble COUNT               spoils the next COUNT answers (checksum or transaction id)
  noise COUNT                answers the next COUNT requests with random bytes (fixed seed)
  log                        the writes since the last "log": FUNCTION:ADDRESS=WORD,WORD ...
  quit
"""
import os
import pty
import random
import select
import socket
import sys
import time
import tty

from pymodbus.datastore import ModbusSequentialDataBlock, ModbusServerContext, ModbusSlaveContext
from pymodbus.factory import ServerDecoder
from pymodbus.pdu import ExceptionResponse
from pymodbus.transaction import ModbusRtuFramer, ModbusSocketFramer

UNIT = 1
REGISTERS = 1000


class Device:
    """The register tables, and the mischief that was ordered."""

    def __init__(self):
        self.store = ModbusSlaveContext(
            hr=ModbusSequentialDataBlock(0, [0] * REGISTERS),
            ir=ModbusSequentialDataBlock(0, [0] * REGISTERS), zero_mode=True)
        self.context = ModbusServerContext(slaves={UNIT: self.store}, single=False)
        self.exception = [0, 0]
        self.exception_on = {}
        self.delay = [0.0, 0]
        self.mute = 0
        self.garble = 0
        self.unit = [UNIT, 0]
        self.noise = 0
        self.random = random.Random(20260301)
        self.clamps = {}
        self.writes = []

    def answer(self, request):
        """The response, or None for silence."""
        function = request.function_code
        if self.delay[1] > 0:
            self.delay[1] -= 1
            time.sleep(self.delay[0])
        if self.mute > 0:
            self.mute -= 1
            return None
        code = self.exception_on.get(function, 0)
        if self.exception[1] > 0:
            self.exception[1] -= 1
            code = self.exception[0]
        if code and code != 5:
            return ExceptionResponse(function, code)
        response = request.execute(self.store)
        if function in (6, 16) and not response.isError():
            self.note_write(function, request)
        return ExceptionResponse(function, code) if code else response

    def note_write(self, function, request):
        words = [request.value] if function == 6 else list(request.values)
        self.writes.append(f"{function}:{request.address}=" + ",".join(f"{w:04X}" for w in words))
        for address, word in self.clamps.items():
            if request.address <= address < request.address + len(words):
                self.store.setValues(3, address, [word])

    def obey(self, line):
        verb, *rest = line.split()
        if verb == "get":
            count = int(rest[1]) if len(rest) > 1 else 1
            return " ".join(f"{w:04X}" for w in self.store.getValues(3, int(rest[0]), count))
        if verb in ("set", "input"):
            words = [int(w, 16) for w in rest[1:]]
            self.store.setValues(3 if verb == "set" else 4, int(rest[0]), words)
        elif verb == "clamp":
            self.clamps[int(rest[0])] = int(rest[1], 16)
        elif verb == "exception":
            self.exception = [int(rest[0]), int(rest[1])]
        elif verb == "exception_on":
            self.exception_on[int(rest[0])] = int(rest[1])
        elif verb == "delay":
            self.delay = [int(rest[0]) / 1000.0, int(rest[1])]
        elif verb == "mute":
            self.mute = int(rest[0])
        elif verb == "unit":
            self.unit = [int(rest[0]), int(rest[1])]
        elif verb == "garble":
            self.garble = int(rest[0])
        elif verb == "noise":
            self.noise = int(rest[0])
        elif verb == "log":
            text, self.writes = " ".join(self.writes), []
            return text
        elif verb == "quit":
            sys.exit(0)
        else:
            return f"unknown order {verb}"
        return "ok"


class Line:
    """One byte stream (a socket or the pty) with its framer."""

    def __init__(self, device, fd, framer, send):
        self.device, self.fd, self.send = device, fd, send
        self.framer = framer(ServerDecoder(), client=None)

    def fileno(self):
        return self.fd

    def feed(self, data):
        if self.device.noise > 0:
            self.device.noise -= 1
            self.send(self.device.random.randbytes(self.device.random.randrange(300)))
            return
        self.framer.processIncomingPacket(data, self.execute, [UNIT])

    def execute(self, request):
        response = self.device.answer(request)
        if response is None:
            return
        response.transaction_id = request.transaction_id
        response.unit_id = request.unit_id
        if self.device.unit[1] > 0:
            self.device.unit[1] -= 1
            response.unit_id = self.device.unit[0]
        packet = bytearray(self.framer.buildPacket(response))
        if self.device.garble > 0:
            self.device.garble -= 1
            packet[-1 if isinstance(self.framer, ModbusRtuFramer) else 1] ^= 0x55
        self.send(bytes(packet))


class Orders:
    def __init__(self, device):
        self.device, self.rest = device, b""

    def fileno(self):
        return 0

    def read(self):
        data = os.read(0, 4096)
        if not data:
            sys.exit(0)  # the test is gone
        *lines, self.rest = (self.rest + data).split(b"\n")
        for line in lines:
            print(self.device.obey(line.decode()), flush=True)


def serve_tcp(device, port):
    listener = socket.socket()
    listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    listener.bind(("127.0.0.1", port))
    listener.listen()
    print("ready", listener.getsockname()[1], flush=True)
    orders, lines = Orders(device), {}
    while True:
        for source in select.select([orders, listener, *lines], [], [])[0]:
            if source is orders:
                orders.read()
            elif source is listener:
                connection = listener.accept()[0]
                connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                line = Line(device, connection.fileno(), ModbusSocketFramer, connection.sendall)
                lines[line] = connection
            else:
                try:
                    data = lines[source].recv(4096)
                    if data:
                        source.feed(data)
                        continue
                except OSError:
                    pass
                lines.pop(source).close()


def serve_rtu(device):
    master, slave = pty.openpty()
    tty.setraw(slave)
    print("ready", os.ttyname(slave), flush=True)
    line = Line(device, master, ModbusRtuFramer, lambda data: os.write(master, data))
    orders = Orders(device)
    while True:
        for source in select.select([orders, line], [], [])[0]:
            if source is orders:
                orders.read()
            else:
                line.feed(os.read(master, 4096))


def main(arguments):
    device = Device()
    if arguments[:1] == ["tcp"]:
        serve_tcp(device, int(arguments[1]) if len(arguments) > 1 else 0)
    elif arguments == ["rtu"]:
        serve_rtu(device)
    else:
        sys.exit(__doc__)


if __name__ == "__main__":
    main(sys.argv[1:])
