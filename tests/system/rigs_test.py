"""Eight rigs on one PC and one gateway for all: the list, each rig's own page and figures, rigs that come and go."""
import contextlib
import json
import pathlib
import queue
import re
import shutil
import subprocess
import tempfile
import threading
import time
import unittest

import chromium
from daemon import RIG, Client, Daemon, endless_campaign
from gateway_world import GATEWAY, Gateway
from page_test import LIVE, LOST, STATE

NAMES = [f"rig{number}" for number in range(1, 9)]
# A busy machine may keep eight simulated sensors, daemons and clients waiting: not what is looked at here.
PATIENT = {**RIG["limits"], "stale_s": 2.0}
CARD = "document.querySelector('[data-rig=\"{}\"]')"


def campaign_of(name):
    campaign = endless_campaign()
    campaign["name"] = f"of {name}"
    campaign["runs"][0]["frequency_hz"] = 8.0  # the first estimate comes after 3 s
    return campaign


def said_of(listed):
    """What the list says of one rig."""
    return listed["name"], listed.get("state"), listed.get("campaign")


def measuring(name):
    """What it says of a rig that measures its own campaign."""
    return name, "MEASURE", f"of {name}"


class Several(unittest.TestCase):
    """Daemons whose view sockets are in one folder, as systemd makes them."""

    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="rigs."))
        self.addCleanup(shutil.rmtree, self.folder, ignore_errors=True)
        self.data = self.folder / "data"
        self.sockets = self.folder / "view"
        self.sockets.mkdir()
        self.daemons = {}

    def daemon(self, name):
        daemon = Daemon({**RIG, "name": f"the rig {name}", "client_lease_s": 30, "limits": PATIENT})
        self.addCleanup(daemon.end)
        daemon.data = self.data / name
        (self.sockets / name).mkdir(exist_ok=True)
        daemon.more += ["--view-socket", str(self.sockets / name / "view.sock")]
        self.daemons[name] = daemon.start()
        return daemon

    def gateway(self):
        gateway = Gateway(self.data, "")
        gateway.words = [GATEWAY, "--rigs", str(self.sockets), "--data", str(self.data)]
        self.addCleanup(gateway.end)
        return gateway.start()

    def browser(self, url, **how):
        browser = chromium.Chromium(**how)
        self.addCleanup(browser.close)
        browser.open(url)
        return browser

    def operator(self, name):
        client = Client(self.daemons[name].socket)
        self.addCleanup(client.close)
        return client


class Eight(Several):
    maxDiff = None

    def setUp(self):
        super().setUp()
        for name in NAMES:
            self.daemon(name)
        self.one = self.gateway()

    def overview(self):
        return {rig["name"]: rig for rig in json.loads(self.one.get("/rigs.json")[2])["rigs"]}

    def knows_estimate(self, name):
        figures = self.one.get(f"/rig/{name}/metrics")[2]
        return said_of(self.overview()[name]) == measuring(name) and b"\nshaker_estimate_cycles" in figures

    def attempt(self, name, told, over):
        """True once there is an estimate and `over` has come; False if the rig stopped before that."""
        with contextlib.closing(Client(self.daemons[name].socket)) as operator:
            end = time.monotonic() + 20
            while "error" in operator.ask("ack") and time.monotonic() < end:
                time.sleep(0.2)
            start = len(operator.lines)
            operator.start(campaign_of(name))
            stopped = lambda line: line.get("severity") == "error"
            came = operator.until(lambda line: line.get("type") == "estimate" or stopped(line), 45, start)
            if stopped(came):
                return False
            # The gateway reads a socket of its own: on a busy machine it is behind this one.
            end = time.monotonic() + 20
            while not self.knows_estimate(name) and time.monotonic() < end:
                operator.send({"jsonrpc": "2.0", "method": "lease.renew"})
                operator.read(0.2)
                if any(stopped(line) for line in operator.lines[start:]):
                    return False
            told.put((name, self.overview()[name]))
            over.wait(60)
            return True

    def operate(self, name, told, over):
        """A busy machine may hold up a daemon, which then stops its rig: an operator starts it again."""
        end, trouble = time.monotonic() + 90, "it stopped again and again"
        while time.monotonic() < end and not over.is_set():
            try:
                if self.attempt(name, told, over):
                    return
            except AssertionError as refusal:
                trouble = str(refusal)
            time.sleep(0.5)
        told.put((name, {"name": name, "state": trouble, "campaign": ""}))

    def test_eight_rigs_measure_at_once_and_each_is_told_as_itself(self):
        over = threading.Event()
        told = queue.Queue()
        threads = [threading.Thread(target=self.operate, args=(name, told, over)) for name in NAMES]
        self.addCleanup(lambda: [thread.join() for thread in threads])
        self.addCleanup(over.set)
        for thread in threads:
            thread.start()
        seen = dict(told.get(timeout=120) for _ in NAMES)
        self.assertEqual({name: said_of(rig) for name, rig in seen.items()},
                         {name: measuring(name) for name in NAMES})
        figures = self.one.get("/metrics")[2].decode()
        for name in NAMES:
            for family in ("shaker_up", "shaker_state", "shaker_estimate_cycles"):
                self.assertTrue(re.search(rf'\n{family}{{rig="{name}"[^}}]*}} [\d.e+-]+\n', figures), (family, name))
            self.assertTrue(f'rig_name="the rig {name}"}} 1\n' in figures, name)
            own = self.one.get(f"/rig/{name}/metrics")[2].decode()
            self.assertTrue(f'rig="the rig {name}"}} 1\n' in own, name)
            self.assertFalse([other for other in NAMES if other != name and other in own], name)
            campaigns = json.loads(self.one.get(f"/rig/{name}/campaigns.json")[2])["campaigns"]
            self.assertTrue(campaigns and all(one["name"].startswith(f"of_{name}_") for one in campaigns), campaigns)
        for family in set(re.findall(r"^# TYPE (\S+)", figures, re.M)):
            self.assertEqual(figures.count(f"# TYPE {family} "), 1)
        self.assertEqual(self.one.get("/rig/none/")[0], 404)
        self.assertEqual(self.one.get("/rig/../../etc/passwd")[0], 404)
        status, headers, _ = self.one.get("/rig/rig3")
        self.assertEqual((status, headers["Location"]), (308, "rig3/"))

    @unittest.skipUnless(chromium.PROGRAM, "there is no chromium: the list is not looked at in a browser")
    def test_the_list_leads_to_each_rig_and_shows_which_is_in_trouble(self):
        browser = self.browser(self.one.url)
        browser.until("document.querySelectorAll('.card').length === 8")
        browser.until("[...document.querySelectorAll('.card .state-name')].every(e => e.innerText.includes('IDLE'))")
        operator = self.operator("rig2")
        operator.start(campaign_of("rig2"))
        operator.until_state("SETTLE")
        operator.ask("estop")
        browser.until(CARD.format("rig2") + ".innerText.includes('FAULT')")
        self.assertRegex(browser.value(CARD.format("rig2") + ".innerText"), r"⚠ \d+ error")
        self.daemons["rig7"].kill()
        browser.until(CARD.format("rig7") + ".innerText.includes('NOT LIVE')")
        self.assertRegex(browser.value("document.title"), "^⚠ 2 of 8 rigs")
        for name in set(NAMES) - {"rig2", "rig7"}:
            self.assertIn("IDLE", browser.value(CARD.format(name) + ".innerText"))
        browser.value(CARD.format("rig5") + ".querySelector('a').click()")
        browser.until(f"location.pathname === '/rig/rig5/' && document.readyState === 'complete'")
        browser.until(f"{STATE}.includes('IDLE') && {LIVE}")
        self.assertIn("the rig rig5", browser.text("#identity"))
        browser.open(self.one.url + "rig/rig7/")
        browser.until(LOST)
        browser.open(self.one.url + "rig/rig2/")
        browser.until(f"{STATE}.includes('FAULT')")
        browser.value("document.querySelector('#all-rigs').click()")
        browser.until("location.pathname === '/' && document.querySelectorAll('.card').length === 8")
        self.daemons["rig7"].start()
        browser.until(CARD.format("rig7") + ".innerText.includes('IDLE')")
        self.assertEqual(browser.trouble(), [])
        self.assertLessEqual(browser.value("document.documentElement.scrollWidth - innerWidth"), 0)


@unittest.skipUnless(chromium.PROGRAM, "there is no chromium: the root is not looked at in a browser")
class ComeAndGo(Several):
    def test_the_root_follows_the_rigs_that_there_are(self):
        gateway = self.gateway()
        browser = self.browser(gateway.url)
        browser.until("document.querySelector('#rigs-none')?.hidden === false && " + LIVE)
        self.daemon("left")
        browser.until(f"document.querySelector('#state-name') && {STATE}.includes('IDLE') && {LIVE}")
        self.assertIn("the rig left", browser.text("#identity"))
        self.assertEqual(browser.value("document.querySelector('#all-rigs').hidden"), True)
        late = self.browser(gateway.url + "rig/left/")
        late.until(f"{STATE}.includes('IDLE') && {LIVE}")
        self.daemon("right")
        browser.until("document.querySelectorAll('.card').length === 2")
        self.assertEqual(late.value("location.pathname"), "/rig/left/")  # who looks at one rig stays there
        self.daemons["left"].end()
        browser.until(CARD.format("left") + ".innerText.includes('NOT LIVE')")
        self.assertIn("IDLE", browser.value(CARD.format("right") + ".innerText"))


class Options(unittest.TestCase):
    def test_bad_words_are_refused(self):
        for words, said in ((["--rig", "left"], "NAME=SOCKET"), (["--rig", "../x=/s"], "a name has"),
                            (["--rig", "a=/s", "--rig", "a=/t"], "another --rig"),
                            (["--rig", "a=/s", "--rig", "b=/s"], "another --rig"),
                            (["--rig", "a=/s", "--socket", "/t"], "excludes"), (["--rigs", "/x", "--rig", "a=/s"], "excludes")):
            done = subprocess.run([GATEWAY, "--port", "0", *words], capture_output=True, text=True, timeout=20)
            self.assertEqual(done.returncode, 2, done.stderr)
            self.assertIn(said, done.stderr)


if __name__ == "__main__":
    unittest.main()
