"""What the gateway says over HTTP: to browsers, to programs that look on, and to those who hang on."""
import contextlib
import json
import pathlib
import re
import shutil
import signal
import socket
import subprocess
import tempfile
import time
import unittest

from daemon import endless_campaign
from gateway_world import GATEWAY, Gateway, World


class Http(World):
    words = ("--max-waiting", "16384")

    def test_every_module_is_asked_for_with_the_page(self):
        page = self.gateway.get("/")[2].decode()
        asked = set(re.findall(r'(?:modulepreload" href|module" src)="(\w+\.js)"', page))
        self.assertIn("page.js", asked)
        for name in sorted(asked):
            status, _, text = self.gateway.get("/" + name)
            self.assertEqual(status, 200, name)
            self.assertLessEqual(set(re.findall(r'from "\./(\w+\.js)"', text.decode())), asked, name)

    def test_headers_are_strict(self):
        for path in ("/", "/page.js", "/metrics", "/campaigns.json", "/nothing"):
            _, headers, _ = self.gateway.get(path)
            self.assertIn("default-src 'none'", headers["Content-Security-Policy"])
            self.assertNotIn("unsafe", headers["Content-Security-Policy"])
            self.assertEqual(headers["X-Content-Type-Options"], "nosniff")

    def raw(self, data):
        with socket.create_connection(("127.0.0.1", self.gateway.port), timeout=3) as connection:
            with contextlib.suppress(ConnectionResetError, BrokenPipeError):
                connection.sendall(data)
            answer = b""
            with contextlib.suppress(ConnectionResetError, TimeoutError):
                while more := connection.recv(65536):
                    answer += more
            return answer

    def test_bad_requests_are_refused_and_hurt_nobody(self):
        for path in ("/../../etc/passwd", "/%2e%2e/%2e%2e/etc/passwd", "/..%2f..%2fetc/passwd", "//etc/passwd",
                     "/campaigns/../rig.json", "/campaigns/%2e%2e%2frig.json", "/reports/..%00.html"):
            answer = self.raw(f"GET {path} HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n".encode())
            self.assertRegex(answer, rb"^HTTP/1.1 4\d\d ", path)
            self.assertNotIn(b"root:", answer)
            self.assertNotIn(b"shaker-rig", answer)
        long_path = self.raw(b"GET /" + b"a" * 200_000 + b" HTTP/1.1\r\nHost: localhost\r\n\r\n")
        self.assertRegex(long_path + b"closed", rb"^(HTTP/1.1 4\d\d |closed)")
        self.raw(b"\x00\xff" * 5000 + b"\r\n\r\n")
        self.raw(b"GET / HTTP/1.1\r\n" + b"X: y\r\n" * 20000 + b"\r\n")
        self.assertEqual(self.gateway.get("/", "POST")[0], 405)
        self.assertEqual(self.gateway.get("/", headers={"Host": "evil.example"})[0], 421)
        self.assertEqual(self.gateway.get("/")[0], 200)

    def events(self, last_id=None, receive_buffer=None):
        connection = socket.socket()
        self.addCleanup(connection.close)
        if receive_buffer:
            connection.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, receive_buffer)
        connection.connect(("127.0.0.1", self.gateway.port))
        more = f"Last-Event-ID: {last_id}\r\n" if last_id is not None else ""
        connection.sendall(f"GET /events HTTP/1.1\r\nHost: localhost\r\n{more}\r\n".encode())
        connection.settimeout(10)
        return connection

    def read_until(self, connection, wanted, timeout=15):
        data, end = b"", time.monotonic() + timeout
        while wanted not in data:
            self.assertLess(time.monotonic(), end, data[-2000:])
            data += connection.recv(65536)
        return data.decode(errors="replace")

    def test_who_comes_again_gets_what_is_newer(self):
        first = self.read_until(self.events(), b"event: ready")
        self.assertIn("event: reset", first)
        newest = int(re.findall(r"^id: (\d+)", first, re.M)[-1])
        again = self.read_until(self.events(newest), b"event: ready")
        self.assertNotIn("event: reset", again)
        rubbish = self.read_until(self.events("x" * 100), b"event: ready")
        self.assertIn("event: reset", rubbish)

    def test_the_numbers_of_events_are_those_of_the_documents(self):
        operator = self.operator()
        connection = self.events()
        operator.ask("ping")
        data = self.read_until(connection, b'"type":"health"')
        data += self.read_until(connection, b'"type":"health"')
        events = re.findall(r'id: (\d+)\r?\ndata: \{"type":"(\w+)","seq":(\d+)', data)
        self.assertTrue(events)
        for number, kind, seq in events:
            self.assertEqual(number, seq, kind)

    def test_a_slow_reader_is_given_up_and_holds_up_nobody(self):
        operator = self.operator()
        operator.start(endless_campaign())
        operator.until_state("MEASURE")
        slow = [self.events(receive_buffer=4096) for _ in range(5)]
        quick = self.events()
        end = time.monotonic() + 60
        received = b""
        while time.monotonic() < end:
            operator.ask("ping")
            received += quick.recv(65536)
            figures = self.gateway.get("/metrics")[2].decode()
            if "shaker_gateway_given_up_total 5" in figures:
                break
        self.assertIn("shaker_gateway_given_up_total 5", figures)
        self.assertIn("shaker_gateway_browsers 1\n", self.settled_metrics())
        self.assertIn(b"event: ready", received)
        for _ in range(2):
            self.read_until(quick, b"event: beat", 3)
        for connection in slow:
            connection.close()

    def settled_metrics(self):
        end = time.monotonic() + 5
        while True:
            text = self.gateway.get("/metrics")[2].decode()
            if "shaker_gateway_browsers 1\n" in text or time.monotonic() > end:
                return text
            time.sleep(0.05)

    def test_metrics_follow_the_rig(self):
        def lines():
            return self.gateway.get("/metrics")[2].decode().splitlines()
        end = time.monotonic() + 10
        while 'shaker_channel_value{channel="displacement",unit="m"} ' not in "\n".join(lines()):
            self.assertLess(time.monotonic(), end)
            time.sleep(0.1)
        self.assertIn("shaker_up 1", lines())
        self.assertIn('shaker_state{state="IDLE"} 1', lines())
        self.daemon.kill()
        end = time.monotonic() + 10
        while "shaker_up 0" not in lines():
            self.assertLess(time.monotonic(), end)
            time.sleep(0.1)
        self.assertFalse([line for line in lines() if "shaker_state" in line])

    def test_it_ends_as_asked_with_browsers_connected(self):
        connections = [self.events() for _ in range(10)]
        for connection in connections:
            self.read_until(connection, b"event: ready")
        self.assertEqual(self.gateway.end(), 0)

    def test_a_second_gateway_says_that_the_port_is_taken(self):
        second = subprocess.run([GATEWAY, "--socket", str(self.view), "--port", str(self.gateway.port)],
                                capture_output=True, text=True, timeout=20)
        self.assertEqual(second.returncode, 1)
        self.assertIn("choose a port that is free", second.stderr)

    def test_a_report_is_given_with_a_policy_of_its_own(self):
        folder = self.daemon.data / "one.diagnosis"
        folder.mkdir()
        (folder / "report.html").write_text("<style>p{}</style><p>found")
        (self.daemon.data / "one.db").write_bytes(b"x")
        status, headers, body = self.gateway.get("/reports/one.html")
        self.assertEqual((status, body), (200, b"<style>p{}</style><p>found"))
        self.assertIn("sandbox", headers["Content-Security-Policy"])
        self.assertNotIn("Content-Disposition", headers)
        self.assertEqual(json.loads(self.gateway.get("/campaigns.json")[2])["campaigns"][0]["report"], True)


class Waiting(unittest.TestCase):
    def test_a_folder_that_is_not_there_is_named(self):
        folder = pathlib.Path(tempfile.mkdtemp(prefix="gateway."))
        self.addCleanup(shutil.rmtree, folder)
        process = subprocess.Popen([GATEWAY, "--rigs", folder / "rgis", "--data", folder / "dtaa", "--port", "0"],
                                   stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
        self.addCleanup(process.stderr.close)
        self.addCleanup(process.wait, 15)
        self.addCleanup(process.send_signal, signal.SIGTERM)
        said = process.stderr.readline() + process.stderr.readline()
        self.assertIn(f"--data {folder}/dtaa: there is no such folder", said)
        self.assertIn(f"--rigs {folder}/rgis: there is no such folder", said)

    def test_it_ends_at_once_while_it_waits_for_the_daemon(self):
        folder = pathlib.Path(tempfile.mkdtemp(prefix="gateway."))
        self.addCleanup(shutil.rmtree, folder)
        mute = socket.socket(socket.AF_UNIX)
        self.addCleanup(mute.close)
        mute.bind(str(folder / "s"))
        mute.listen()
        gateway = Gateway(folder, folder / "s").start()
        self.addCleanup(gateway.end)
        mute.settimeout(10)
        link, _ = mute.accept()  # it waits for a greeting, which never comes
        self.addCleanup(link.close)
        began = time.monotonic()
        self.assertEqual(gateway.end(), 0)
        self.assertLess(time.monotonic() - began, 1.0)


if __name__ == "__main__":
    unittest.main()
