"""shakerd-stop-exciter against python3-pymodbus: usage  stop_exciter_test.py PROGRAM SOURCE_DIR"""
import contextlib
import json
import pathlib
import socket
import subprocess
import sys
import tempfile
import threading
import time
import unittest

PROGRAM, SOURCE = sys.argv[1], pathlib.Path(sys.argv[2])
FREQUENCY, AMPLITUDE, ENABLE = 100, 102, 104


class Server:
    """modbus_server.py, obeying orders."""

    def __init__(self, *where):
        self.process = subprocess.Popen(
            ["/usr/bin/python3", str(SOURCE / "tests/drivers/modbus_server.py"), *where],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        self.place = self.process.stdout.readline().split()[1]

    def order(self, text):
        self.process.stdin.write(text + "\n")
        self.process.stdin.flush()
        return self.process.stdout.readline().strip()

    def close(self):
        self.process.kill()
        self.process.wait()
        self.process.stdin.close()
        self.process.stdout.close()


def rig(transport, **link):
    return {
        "format": "shaker-rig/1", "name": "stand-in",
        "exciter": {"device": {
            "kind": "modbus",
            "link": {"transport": transport, "response_timeout_s": 0.9, **link},
            "registers": {
                "frequency": {"address": FREQUENCY, "type": "f32", "order": "cdab"},
                "amplitude": {"address": AMPLITUDE, "type": "f32", "order": "cdab"},
                "enable": {"address": ENABLE, "type": "u16"},
                "ramp": {"address": 105, "type": "u16", "scale": 0.1},
                "heartbeat": {"address": 106, "type": "u16", "cyclic": True},
                "status": {"table": "input", "address": 200, "type": "u16"},
                "fault": {"table": "input", "address": 201, "type": "u16"}}}},
        # A sensor that cannot be made: no reason not to stop.
        "sensors": [{"kind": "can", "dbc": "missing.dbc", "signals": [
            {"channel": "displacement", "message": "M", "signal": "S"}]}],
        "limits": {}}


def stop(content, *arguments):
    with tempfile.TemporaryDirectory() as folder:
        file = pathlib.Path(folder) / "rig.json"
        file.write_text(content if isinstance(content, str) else json.dumps(content))
        return subprocess.run([PROGRAM, str(file), *arguments], capture_output=True, text=True,
                              timeout=60)


def tcp(port):
    return {"kind": "tcp", "host": "127.0.0.1", "port": int(port)}


class StopExciter(unittest.TestCase):
    def running(self, *where):
        server = Server(*where)
        self.addCleanup(server.close)
        server.order(f"set {FREQUENCY} 0000 4020 0000 4110 0001")
        return server

    def assert_stopped(self, done, server):
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        self.assertEqual(server.order(f"get {AMPLITUDE} 3"), "0000 0000 0000")

    def test_stops_over_tcp(self):
        server = self.running("tcp")
        self.assert_stopped(stop(rig(tcp(server.place))), server)

    def test_stops_over_a_serial_line(self):
        server = self.running("rtu")
        transport = {"kind": "rtu", "device": server.place, "baud": 115200}
        self.assert_stopped(stop(rig(transport)), server)

    def test_keeps_trying_until_the_device_is_there(self):
        with socket.socket() as probe:
            probe.bind(("127.0.0.1", 0))
            port = probe.getsockname()[1]
        late = []
        begin = threading.Timer(0.5, lambda: late.append(self.running("tcp", str(port))))
        begin.start()
        done = stop(rig(tcp(port)), "--for", "20")
        begin.join()
        self.assert_stopped(done, late[0])

    def test_says_that_the_exciter_may_still_run(self):
        with socket.socket() as closed:  # bound, but nobody listens
            closed.bind(("127.0.0.1", 0))
            started = time.monotonic()
            done = stop(rig(tcp(closed.getsockname()[1])), "--for", "0.3")
        self.assertEqual(done.returncode, 1)
        self.assertIn("the exciter may still be running: Modbus TCP 127.0.0.1", done.stderr)
        self.assertEqual(len(done.stderr.splitlines()), 1)
        self.assertGreater(time.monotonic() - started, 0.3)

    def test_leaves_a_device_that_hangs_up_a_tenth_of_a_second(self):
        calls = []
        with socket.create_server(("127.0.0.1", 0)) as device:
            def hang_up():
                with contextlib.suppress(OSError):
                    while True:
                        device.accept()[0].close()
                        calls.append(time.monotonic())
            threading.Thread(target=hang_up, daemon=True).start()
            done = stop(rig(tcp(device.getsockname()[1])), "--for", "0.5")
            device.shutdown(socket.SHUT_RDWR)
        self.assertEqual(done.returncode, 1)
        self.assertGreater(len(calls), 1)
        self.assertLess(len(calls), 30, "calls in half a second")

    def test_says_when_the_device_disobeys(self):
        server = self.running("tcp")
        server.order(f"clamp {ENABLE} 0001")
        done = stop(rig(tcp(server.place)), "--for", "0")
        self.assertEqual(done.returncode, 1)
        self.assertIn("enable was written as 0 but reads back as 1", done.stderr)

    def test_stops_what_the_daemon_drove_though_the_file_was_edited(self):
        server, other = self.running("tcp"), self.running("tcp")
        with tempfile.TemporaryDirectory() as folder:
            used = pathlib.Path(folder) / "used.json"
            used.write_text(json.dumps(rig(tcp(server.place))))
            self.assert_stopped(stop(rig(tcp(other.place)), "--used", str(used)), server)
            self.assertEqual(other.order(f"get {AMPLITUDE} 3"), "0000 4110 0001")
            server.order(f"set {FREQUENCY} 0000 4020 0000 4110 0001")
            self.assert_stopped(stop("{ no longer good", "--used", str(used)), server)

    def test_goes_by_the_file_where_there_is_no_good_copy(self):
        server = self.running("tcp")
        with tempfile.TemporaryDirectory() as folder:
            used = pathlib.Path(folder) / "used.json"
            self.assert_stopped(stop(rig(tcp(server.place)), "--used", str(used)), server)
            server.order(f"set {FREQUENCY} 0000 4020 0000 4110 0001")
            used.write_text("{")
            self.assert_stopped(stop(rig(tcp(server.place)), "--used", str(used)), server)

    def test_says_what_is_wrong_with_the_file(self):
        self.assertEqual(stop("{").returncode, 1)
        wrong = rig(tcp(502))
        del wrong["exciter"]["device"]["registers"]["fault"]
        done = stop(wrong)
        self.assertEqual(done.returncode, 1)
        self.assertIn("fault", done.stderr)
        self.assertEqual(subprocess.run([PROGRAM], capture_output=True, check=False).returncode, 1)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
