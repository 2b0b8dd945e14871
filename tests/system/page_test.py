"""The page of the gateway in Debian's Chromium: a campaign from start to end, an alarm, a lost connection, a late joiner."""
import contextlib
import http.client
import json
import os
import pathlib
import re
import shutil
import signal
import socket
import subprocess
import tempfile
import time
import unittest

import chromium
from daemon import CAMPAIGN, Client, Daemon, endless_campaign

GATEWAY = os.environ["GATEWAY"]
STATE = "document.querySelector('#state-name').textContent"
LOST = "!document.querySelector('#lost').hidden"
LIVE = "document.querySelector('#lost').hidden"


class Gateway:
    def __init__(self, data, view, *words):
        self.words = [GATEWAY, "--socket", str(view), "--data", str(data), *words]
        self.port = 0
        self.process = None

    def start(self):
        self.process = subprocess.Popen([*self.words, "--port", str(self.port)], stdout=subprocess.PIPE,
                                        stderr=subprocess.DEVNULL, text=True)
        said = self.process.stdout.readline()
        self.port = int(re.search(r":(\d+)/", said).group(1))
        self.url = f"http://127.0.0.1:{self.port}/"
        return self

    def end(self):
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGTERM)
            self.process.wait(15)
        self.process.stdout.close()
        return self.process.returncode

    def get(self, path, method="GET", headers=None):
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=10)
        try:
            connection.request(method, path, headers=headers or {})
            answer = connection.getresponse()
            return answer.status, dict(answer.getheaders()), answer.read()
        finally:
            connection.close()


class World(unittest.TestCase):
    """A daemon with a view socket, and a gateway on it."""

    words = ()

    def setUp(self):
        self.daemon = Daemon()
        self.addCleanup(self.daemon.end)
        self.view = self.daemon.directory / "view.sock"
        self.daemon.more += ["--view-socket", str(self.view)]
        self.daemon.start()
        self.gateway = Gateway(self.daemon.data, self.view, *self.words).start()
        self.addCleanup(self.gateway.end)
        end = time.monotonic() + 10
        while b"shaker_state" not in self.gateway.get("/metrics")[2]:  # it has met the daemon
            self.assertLess(time.monotonic(), end)
            time.sleep(0.05)

    def operator(self):
        client = Client(self.daemon.socket)
        self.addCleanup(client.close)
        return client


@unittest.skipUnless(chromium.PROGRAM, "there is no chromium: the page is not looked at in a browser")
class Page(World):
    def browser(self, **how):
        browser = chromium.Chromium(**how)
        self.addCleanup(browser.close)
        browser.open(self.gateway.url)
        return browser

    def assert_clean(self, browser):
        """No exception, nothing refused by the policy, nothing from elsewhere, nothing to scroll sideways for."""
        self.assertEqual(browser.trouble(), [])
        self.assertLessEqual({re.match(r"https?://[^/]*/", url).group(0) for url in browser.requested()
                              if not url.startswith("data:")}, {self.gateway.url})
        self.assertLessEqual(browser.value("document.documentElement.scrollWidth - innerWidth"), 0)
        self.assertNotRegex(browser.text("body"), r"\bNaN\b|\bInfinity\b|undefined|\[object")

    def test_a_campaign_from_start_to_end(self):
        browser = self.browser()
        browser.until(f"{STATE}.includes('IDLE') && {LIVE}")
        operator = self.operator()
        operator.start(CAMPAIGN)
        operator.until_state("MEASURE")
        browser.until(f"{STATE}.includes('MEASURE')")
        operator.until(lambda line: line.get("type") == "estimate", 30)
        browser.until("document.querySelectorAll('#parameters .plot canvas').length === 4")
        browser.until("document.querySelector('#cycle-which').textContent.includes('accepted')")
        self.assertRegex(browser.text("#progress-text"), r"run 1 of 2, cycle \d+ of 4")
        self.assertIn("pid", browser.text("#identity"))
        self.assertIn("two short runs", browser.text("#identity"))
        self.assertRegex(browser.text("#limit-bars"), r"stroke, mm\s+\d+ … \d+ of 0 … 185; .*% left")
        before = len(operator.lines)
        operator.until_state("IDLE", start=before, timeout=60)
        browser.until(f"{STATE}.includes('IDLE')")
        # What one reads is what the daemon said.
        last = operator.of_type("estimate")[-1]
        for parameter in (p for p in last["parameters"] if not p["fixed"]):
            shown = float(re.search(rf"{parameter['name']} = ([\d.]+) ±", browser.text("#parameters")).group(1))
            self.assertLess(abs(shown - parameter["value"]), parameter["standard_error"])
        gap = float(re.search(r"cycles: ([\d.]+) times", browser.text("#gap")).group(1))
        self.assertLess(abs(gap - last["gap"] / last["noise_floor"]), 0.01 * gap)
        browser.until("document.querySelector('#campaigns a') !== null", 10)
        link = browser.value("document.querySelector('#campaigns a').href")
        status, headers, data = self.gateway.get(link[len(self.gateway.url) - 1:])
        self.assertEqual((status, data[:15]), (200, b"SQLite format 3"))
        self.assertIn("attachment", headers["Content-Disposition"])
        self.assert_clean(browser)

    def test_an_alarm_stays_until_it_is_acknowledged(self):
        browser = self.browser()
        operator = self.operator()
        operator.start(CAMPAIGN)
        operator.until_state("SETTLE")
        operator.ask("estop")
        browser.until(f"{STATE}.includes('FAULT')")
        self.assertIn("emergency_stop", browser.text("#alarm-list li.error"))
        self.assertRegex(browser.value("document.title"), "^⚠ FAULT")
        late = self.browser(width=390, height=844, phone=True)
        late.until("document.querySelector('#alarm-list li.error') !== null")
        self.assertRegex(late.text("#alarm-list li.error"), r"\d+:\d\d:\d\d")
        time.sleep(1.5)
        self.assertIn("emergency_stop", browser.text("#alarm-list"))
        end = time.monotonic() + 20
        while "error" in operator.ask("ack") and time.monotonic() < end:
            time.sleep(0.2)
        for one in (browser, late):
            one.until(f"{STATE}.includes('IDLE') && document.querySelector('#alarm-list').innerText.trim() === 'none'")
            self.assert_clean(one)

    def test_a_lost_connection_is_told_in_red_over_everything(self):
        browser = self.browser()
        browser.until(f"{STATE}.includes('IDLE') && {LIVE}")
        self.daemon.kill()
        browser.until(LOST, 5)
        self.assertIn("shakerd", browser.text("#lost"))
        covered = browser.value("(() => { const b = document.querySelector('#lost').getBoundingClientRect();"
                                " return [b.width >= document.documentElement.clientWidth, b.height >= innerHeight]; })()")
        self.assertEqual(covered, [True, True])
        self.daemon.start()
        browser.until(f"{LIVE} && {STATE}.includes('IDLE')", 15)
        self.daemon.process.send_signal(signal.SIGSTOP)  # it hangs
        browser.until(LOST, 10)
        self.daemon.process.send_signal(signal.SIGCONT)
        browser.until(LIVE, 15)
        self.gateway.end()
        browser.until(LOST, 5)
        self.assertIn("shakerd-gateway has ended", browser.text("#lost"))
        self.gateway.start()
        browser.until(f"{LIVE} && {STATE}.includes('IDLE')", 15)
        # In this test the browser's own complaints about the lost connection are right.
        self.assertFalse([one for one in browser.trouble() if "ERR_" not in one and "Failed to load" not in one])

    def test_a_late_joiner_sees_the_whole_campaign(self):
        operator = self.operator()
        operator.start(CAMPAIGN)
        operator.until(lambda line: line.get("type") == "run_stop" and line["run"] == "slow", 45)
        operator.until(lambda line: line.get("type") == "estimate" and line["run"] == "fast", 45)
        late = self.browser(width=820, height=1180, dark=True)
        late.until("document.querySelectorAll('#parameters .plot canvas').length === 4")
        shown = late.value("document.querySelector('#estimate-which').textContent")
        self.assertIn("runs: 2", shown)
        points = late.value("performance.now() > 0 && document.querySelectorAll('#parameters .plot').length")
        self.assertEqual(points, 4)
        self.assertRegex(late.text("#progress-text"), r"run 2 of 2, cycle \d+ of 6")
        self.assert_clean(late)

    def test_a_new_campaign_forgets_the_old_one(self):
        browser = self.browser()
        operator = self.operator()
        operator.start(CAMPAIGN)
        operator.until(lambda line: line.get("type") == "estimate", 45)
        browser.until("document.querySelector('#estimate-which').textContent.includes('cycles')")
        operator.ask("stop")
        before = len(operator.lines)
        operator.until_state("IDLE", start=before)
        operator.start(endless_campaign())
        operator.until_state("RAMP", start=before)
        browser.until("document.querySelector('#estimate-which').textContent.includes('none')")
        browser.until("document.querySelector('#cycle-which').textContent.includes('none')")
        self.assertEqual(browser.value("document.querySelectorAll('#parameters .plot').length"), 0)
        self.assert_clean(browser)


    def test_what_the_page_computes_is_right(self):
        browser = self.browser()
        # The rate of u = 3 + 2 cos(x) - 0.5 sin(3 x) at 2 Hz, against its formula.
        worst = browser.value("""import('/rig.js').then(({ derivative }) => {
            const n = 64, omega = 4 * Math.PI, at = [...Array(n).keys()].map(i => 2 * Math.PI * i / n);
            const rate = derivative(at.map(x => 3 + 2 * Math.cos(x) - 0.5 * Math.sin(3 * x)), 2);
            const right = x => omega * (-2 * Math.sin(x) - 1.5 * Math.cos(3 * x));
            return Math.max(...at.map((x, i) => Math.abs(rate[i] - right(x)))); })""")
        self.assertLess(worst, 1e-9)
        # A long campaign: bounded, in order, the newest whole and the first still there in part.
        kept = browser.value("""import('/rig.js').then(({ Rig, MOST }) => { const rig = new Rig();
            for (let i = 1; i <= 20000; ++i) rig.take({ type: 'estimate', cycles_used: i, covariance: [[i]] });
            const used = rig.estimates.map(e => e.cycles_used);
            return [used.length <= MOST, used.every((c, i) => i === 0 || c > used[i - 1]), used.at(-1), used[0] === 1,
                    rig.estimates.filter(e => e.covariance).length]; })""")
        self.assertEqual(kept, [True, True, 20000, True, 1])
        words = browser.value("""import('/words.js').then(({ measured, figure, duration, bytes }) => [
            measured(16.7234, 0.0521), measured(1234567, 2345), measured(1, NaN), figure(0.000012), figure(NaN),
            duration(3725), duration(61), bytes(70500000000), figure(299.98, 4)])""")
        self.assertEqual(words, ["16.723 ± 0.052", "1234567 ± 2345", "1", "1.200e-5", "–", "1 h 2 min", "1 min 1 s",
                                 "70.5 GB", "300"])


class Http(World):
    words = ("--max-waiting", "16384")

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
