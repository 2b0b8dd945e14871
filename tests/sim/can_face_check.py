"""oleosim's frames on a real vcan, seen and driven by python-can. Exit status 77: no such interface."""
import atexit
import json
import pathlib
import socket
import struct
import subprocess
import sys
import tempfile
import time

import can

INTERFACE = "vcan0"
SO_RCVBUFFORCE = 33  # not in Python's socket module


def setpoint(enable, beat):
    data = struct.pack("<HHBBH", 2000, 3000, 1 if enable else 0, 2, beat)
    return can.Message(arbitration_id=256, data=data, is_extended_id=False)


def main(program):
    if not pathlib.Path(f"/sys/class/net/{INTERFACE}").exists():
        print(f"no {INTERFACE} here: skipped")
        return 77
    with tempfile.TemporaryDirectory() as folder:
        status = pathlib.Path(folder) / "status.json"
        bus = can.interface.Bus(INTERFACE, bustype="socketcan")
        # A busy machine reads late: the kernel keeps all that the rig sends meanwhile.
        bus.socket.setsockopt(socket.SOL_SOCKET, SO_RCVBUFFORCE, 16 << 20)
        oleosim = subprocess.Popen([program, "--can", INTERFACE, "--port", "0", "--status-file",
                                    str(status)], stdout=subprocess.PIPE, text=True)
        atexit.register(oleosim.kill)
        assert oleosim.stdout.readline().startswith("ready")
        assert json.loads(status.read_text())["can"] == INTERFACE
        frames, beat, end = [], 0, time.monotonic() + 2.0
        next_beat = 0.0
        while time.monotonic() < end:
            if time.monotonic() >= next_beat:
                next_beat = time.monotonic() + 0.05
                beat += 1
                bus.send(setpoint(True, beat))
            message = bus.recv(0.05)
            if message:
                frames.append(message)
        oleosim.terminate()
        assert oleosim.wait(timeout=10) == 0
        while message := bus.recv(0.2):
            frames.append(message)
    strokes = [struct.unpack("<fHB", m.data) for m in frames if m.arbitration_id == 385]
    tables = [struct.unpack(">iH", m.data) for m in frames if m.arbitration_id == 386]
    states = [struct.unpack("<HHHH", m.data) for m in frames if m.arbitration_id == 257]
    counters = [s[1] for s in strokes]
    assert len(strokes) > 1800 and abs(len(strokes) - len(tables)) <= 1, (len(strokes), len(tables))
    assert counters == list(range(counters[0], counters[0] + len(counters))), "gaps"
    assert 2.9 < max(t[0] for t in tables) * 1e-5 < 3.1
    assert all(0.13 < s[0] < 0.18 and s[2] == 0 for s in strokes)
    assert states[-1] == (3, 0, 2000, 3000), states[-1]
    print(f"{len(strokes)} samples without a gap")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
