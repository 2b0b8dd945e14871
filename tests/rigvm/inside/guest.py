"""What a scenario on the virtual rig PC needs: steps with names, waits with limits, and independent
clients of the three wires (the daemon's socket, Modbus, CAN). Nothing here is shakerd's own code."""
import json
import socket
import subprocess
import sys
import threading
import time

import can
from pymodbus.client import ModbusTcpClient

BEGAN = time.monotonic()


def step(text):
    print(f"[{time.monotonic() - BEGAN:6.1f} s] {text}", flush=True)


def expect(holds, sentence):
    if not holds:
        step("FAILED: " + sentence)
        sys.exit(1)


def wait_for(what, seconds, probe):
    """The first true value of probe(), or the end of the scenario with a sentence."""
    end = time.monotonic() + seconds
    while True:
        value = probe()
        if value:
            return value
        expect(time.monotonic() < end, f"{what}: not within {seconds} s")
        time.sleep(0.05)


def run(*command, seconds=60, check=True):
    done = subprocess.run(command, capture_output=True, text=True, timeout=seconds)
    if check and done.returncode != 0:
        print(done.stdout + done.stderr, flush=True)
        expect(False, f"{' '.join(command)} ended with status {done.returncode}")
    return done


def unit_property(unit, name):
    return run("systemctl", "show", "--value", "-p", name, unit).stdout.strip()


def journal(unit):
    return run("journalctl", "--no-pager", "-o", "cat", "-u", unit).stdout


class Listener:
    """A client that only listens: every document that the daemon has published to it."""

    def __init__(self, path):
        self.documents = []
        self.closed = False
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        self._socket.connect(path)
        threading.Thread(target=self._read, daemon=True).start()

    def _read(self):
        rest = b""
        while True:
            try:
                block = self._socket.recv(65536)
            except OSError:
                block = b""
            if not block:
                self.closed = True
                return
            *lines, rest = (rest + block).split(b"\n")
            self.documents += [json.loads(line) for line in lines if line]

    def of_type(self, kind):
        return [d for d in list(self.documents) if d.get("type") == kind]

    def state(self):
        states = self.of_type("state")
        return states[-1]["state"] if states else None


class Registers:
    """Reads the exciter's holding registers as a stranger would."""

    def __init__(self, port, unit=1):
        self._client = ModbusTcpClient("127.0.0.1", port=port)
        self._unit = unit

    def read(self, address, count=1):
        return self._ask(self._client.read_holding_registers, address, count)

    def read_input(self, address, count=1):
        return self._ask(self._client.read_input_registers, address, count)

    def _ask(self, question, address, count):
        for _ in range(3):
            answer = question(address, count, slave=self._unit)
            if not answer.isError():
                return answer.registers
            self._client.close()
            time.sleep(0.1)
        expect(False, f"an independent Modbus client cannot read register {address}: {answer}")


class Bus:
    """Every frame on the bus, with its kernel time, as python-can sees it."""

    def __init__(self, interface):
        self.frames = []
        self._bus = can.Bus(interface="socketcan", channel=interface)
        threading.Thread(target=self._read, daemon=True).start()

    def _read(self):
        for message in self._bus:
            self.frames.append((message.timestamp, message.arbitration_id, bytes(message.data)))
