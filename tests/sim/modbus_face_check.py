"""An independent Modbus client (pymodbus) against the running oleosim, over TCP and over RTU."""
import atexit
import json
import math
import pathlib
import signal
import struct
import subprocess
import sys
import tempfile
import time

from pymodbus.client import ModbusSerialClient, ModbusTcpClient
from pymodbus.framer.rtu_framer import ModbusRtuFramer

FREQUENCY, AMPLITUDE, ENABLE, RAMP, HEARTBEAT, TIMEOUT, RESET, INJECT = 0, 2, 4, 5, 7, 8, 10, 11
RUNNING, READY = 1, 2
FAULTS = ["none", "sensor_frozen", "sensor_nan", "sensor_silent", "sensor_inverted",
          "exciter_trip", "exciter_deaf", "exciter_silent"]


def f32_words(value):
    return list(struct.unpack(">HH", struct.pack(">f", value)))


def f32(words):
    return struct.unpack(">f", struct.pack(">HH", *words))[0]


def u32(words):
    return words[0] << 16 | words[1]


class Rig:
    """Reads and writes by meaning."""

    def __init__(self, client):
        self.client = client
        assert client.connect(), "cannot connect"

    def inputs(self, slave=1):
        answer = self.client.read_input_registers(0, 14, slave=slave)
        assert not answer.isError(), answer
        r = answer.registers
        return {"status": r[0], "fault": r[1], "frequency": f32(r[2:4]), "amplitude": f32(r[4:6]),
                "displacement": f32(r[6:8]), "excitation": f32(r[8:10]), "us": u32(r[10:12]),
                "counter": u32(r[12:14])}

    def holding(self):
        answer = self.client.read_holding_registers(0, 12, slave=1)
        assert not answer.isError(), answer
        return answer.registers

    def write(self, address, words):
        answer = self.client.write_registers(address, words, slave=1)
        return answer.exception_code if answer.isError() else 0

    def write_one(self, address, value):
        answer = self.client.write_register(address, value, slave=1)
        return answer.exception_code if answer.isError() else 0

    def start(self, frequency, amplitude, ramp=0.0):
        assert self.write(FREQUENCY, f32_words(frequency) + f32_words(amplitude)) == 0
        assert self.write(RAMP, f32_words(ramp)) == 0
        assert self.write_one(ENABLE, 1) == 0


class Program:
    def __init__(self, program, folder, *options):
        self.status = pathlib.Path(folder) / "status.json"
        self.process = subprocess.Popen([program, "--status-file", str(self.status), *options],
                                        stdout=subprocess.PIPE, text=True)
        atexit.register(self.process.kill)  # a failing check leaves nothing running
        self.line = self.process.stdout.readline()
        assert self.line.startswith("ready"), self.line

    def stop(self):
        self.process.send_signal(signal.SIGTERM)
        assert self.process.wait(timeout=10) == 0, "no clean exit on SIGTERM"


def wait_for(condition, seconds=5.0):
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        if condition():
            return True
        time.sleep(0.01)
    return False


def check_setpoints(rig):
    rig.write(TIMEOUT, f32_words(0.0))
    rig.start(2.0, 3.0)
    registers = rig.holding()
    assert f32(registers[0:2]) == 2.0 and f32(registers[2:4]) == 3.0 and registers[ENABLE] == 1
    now = rig.inputs()
    assert now["status"] == RUNNING | READY and now["fault"] == 0, now
    assert now["amplitude"] == 3.0 and now["frequency"] == 2.0
    rig.write(AMPLITUDE, f32_words(0.0))
    assert wait_for(lambda: rig.inputs()["status"] == READY)
    assert rig.write_one(ENABLE, 0) == 0


def check_refusals(rig):
    before = rig.holding()
    assert rig.write_one(FREQUENCY, 0x4000) == 2, "half of a 32-bit value"
    assert rig.write(FREQUENCY + 1, [0, 0]) == 2
    assert rig.write(20, [1]) == 2
    assert rig.write(FREQUENCY, f32_words(51.0)) == 3
    assert rig.write(FREQUENCY, f32_words(math.nan)) == 3
    assert rig.write(FREQUENCY, f32_words(1.0) + f32_words(-2.0)) == 3
    assert rig.write_one(ENABLE, 2) == 3
    assert rig.write_one(INJECT, 8) == 3
    assert rig.client.read_coils(0, 1, slave=1).exception_code == 1
    assert rig.client.write_register(ENABLE, 1, slave=2).exception_code == 1, "sensors are read only"
    assert rig.client.read_input_registers(0, 2, slave=7).exception_code == 11
    assert rig.client.read_input_registers(10, 21, slave=1).exception_code == 2
    assert rig.holding() == before, "a refused write changed something"


def check_samples(rig):
    """Every poll gives the newest sample: displacement, excitation and stamp of one instant."""
    rig.start(2.0, 3.0)
    time.sleep(1.0)  # the damper's transient
    seen, begin = [], time.monotonic()
    while time.monotonic() - begin < 1.5:
        seen.append(rig.inputs(slave=2))
    seen_last = time.monotonic()
    counters = [s["counter"] for s in seen]
    assert counters == sorted(counters) and len(set(counters)) > 100, len(set(counters))
    assert all(s["us"] == 1000 * s["counter"] for s in seen)
    span = (seen[-1]["us"] - seen[0]["us"]) * 1e-6
    assert abs(span - (seen_last - begin)) < 0.2, span
    # The excitation is one cosine of the device's own time.
    waves = [(math.cos(4 * math.pi * s["us"] * 1e-6), math.sin(4 * math.pi * s["us"] * 1e-6),
              s["excitation"]) for s in seen]
    cc, ss, cs = (sum(w[i] * w[j] for w in waves) for i, j in ((0, 0), (1, 1), (0, 1)))
    cx, sx = (sum(w[i] * w[2] for w in waves) for i in (0, 1))
    det = cc * ss - cs * cs
    a, b = (cx * ss - sx * cs) / det, (sx * cc - cx * cs) / det
    assert abs(math.hypot(a, b) - 3.0) < 0.01, math.hypot(a, b)
    worst = max(abs(x - a * c - b * s) for c, s, x in waves)
    assert worst < 0.03, worst  # six times the noise
    strokes = [s["displacement"] for s in seen]
    assert 0.13 < min(strokes) < 0.15 and 0.17 < max(strokes) < 0.18, (min(strokes), max(strokes))


def check_dead_man(rig):
    rig.write_one(ENABLE, 0)
    rig.write(TIMEOUT, f32_words(1.0))
    rig.start(2.0, 3.0)
    for beat in range(30):
        assert rig.write_one(HEARTBEAT, 100 + beat) == 0
        time.sleep(0.05)
    assert rig.inputs()["status"] & RUNNING
    assert wait_for(lambda: not rig.inputs()["status"] & RUNNING)
    assert rig.inputs()["fault"] == 1 and rig.holding()[ENABLE] == 0
    assert rig.write_one(ENABLE, 1) == 4, "enabling with a fault"
    assert rig.write_one(RESET, 1) == 0
    assert rig.inputs()["fault"] == 0 and not rig.inputs()["status"] & RUNNING
    rig.write(TIMEOUT, f32_words(0.0))


def check_faults(rig):
    rig.start(2.0, 3.0)
    time.sleep(0.02)
    rig.write_one(INJECT, FAULTS.index("sensor_nan"))
    assert rig.holding()[INJECT] == FAULTS.index("sensor_nan")
    assert wait_for(lambda: math.isnan(rig.inputs(2)["displacement"]))
    rig.write_one(INJECT, FAULTS.index("sensor_inverted"))
    assert wait_for(lambda: rig.inputs(2)["displacement"] < -0.1)
    rig.write_one(INJECT, FAULTS.index("sensor_frozen"))
    time.sleep(0.02)
    first = rig.inputs(2)
    time.sleep(0.1)
    later = rig.inputs(2)
    assert later["displacement"] == first["displacement"] and later["counter"] > first["counter"]
    rig.write_one(INJECT, FAULTS.index("exciter_trip"))
    assert rig.inputs()["fault"] == 2 and not rig.inputs()["status"] & RUNNING
    assert rig.write_one(RESET, 1) == 0
    rig.write_one(INJECT, 0)


def check_clients(port):
    """Several at once, and one that sends half a message and stays."""
    import socket
    rude = socket.create_connection(("127.0.0.1", port))
    rude.sendall(b"\x00\x01\x00\x00\x00\x06\x01")
    rigs = [Rig(ModbusTcpClient("127.0.0.1", port=port, timeout=2)) for _ in range(5)]
    for _ in range(3):
        for rig in rigs:
            assert rig.inputs()["counter"] > 0
    rubbish = socket.create_connection(("127.0.0.1", port))
    rubbish.sendall(b"GET / HTTP/1.0\r\n\r\n" * 30)
    for rig in rigs:
        assert rig.inputs()["counter"] > 0
        rig.client.close()
    rude.close()
    rubbish.close()


def check_silence(program, folder):
    """A scripted silence: no answer, and the controller's own dead-man has stopped the table."""
    oleosim = Program(program, folder, "--port", "0", "--fault", "exciter_silent@0.8",
                      "--fault", "none@4", "--heartbeat-timeout", "0.3")
    port = json.loads(oleosim.status.read_text())["port"]
    rig = Rig(ModbusTcpClient("127.0.0.1", port=port, timeout=1, retries=0))
    begin = time.monotonic()
    rig.start(2.0, 3.0)
    answered, beat = True, 0
    while answered and time.monotonic() < begin + 2.0:
        beat += 1
        answer = rig.client.write_register(HEARTBEAT, beat, slave=1)
        answered = not answer.isError()
        time.sleep(0.05)
    assert not answered, "still answering"
    sensor = Rig(ModbusTcpClient("127.0.0.1", port=port, timeout=1))
    assert abs(sensor.inputs(slave=2)["excitation"]) < 0.05, "the sensors still answer; all is still"
    time.sleep(max(0.0, begin + 4.2 - time.monotonic()))
    again = Rig(ModbusTcpClient("127.0.0.1", port=port, timeout=1))
    assert again.inputs()["fault"] == 1
    oleosim.stop()


def main(program):
    with tempfile.TemporaryDirectory() as folder:
        link, truth = f"{folder}/rig-pty", pathlib.Path(folder) / "truth.json"
        oleosim = Program(program, folder, "--port", "0", "--pty", link, "--truth-file", str(truth),
                          "--param", "theta1=17.5")
        status = json.loads(oleosim.status.read_text())
        assert f"port={status['port']}" in oleosim.line and status["port"] > 0
        assert json.loads(truth.read_text())["parameters"]["theta1"] == 17.5
        rig = Rig(ModbusTcpClient("127.0.0.1", port=status["port"], timeout=2))
        for check in (check_setpoints, check_refusals, check_samples, check_dead_man, check_faults):
            check(rig)
            print(check.__name__, "over TCP: good", flush=True)
        check_clients(status["port"])
        print("check_clients: good", flush=True)
        serial = Rig(ModbusSerialClient(link, framer=ModbusRtuFramer, baudrate=115200, timeout=2))
        for check in (check_setpoints, check_dead_man):
            check(serial)
            print(check.__name__, "over RTU: good", flush=True)
        serial.client.close()
        oleosim.stop()
        assert not pathlib.Path(link).is_symlink(), "the link stays behind"
        check_silence(program, folder)
        print("check_silence: good")


if __name__ == "__main__":
    main(sys.argv[1])
