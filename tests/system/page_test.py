"""The page of the gateway in Debian's Chromium: a campaign from start to end, an alarm, a lost connection, a late joiner."""
import json
import re
import signal
import time
import unittest

import chromium
from daemon import CAMPAIGN, endless_campaign
from gateway_world import World

STATE = "document.querySelector('#state-name').textContent"
LOST = "!document.querySelector('#lost').hidden"
LIVE = "document.querySelector('#lost').hidden"


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
        operator.start({**CAMPAIGN, "specimen": {"serial": "N-042", "charge": "18 bar"}})
        operator.until_state("MEASURE")
        browser.until(f"{STATE}.includes('MEASURE')")
        self.assertIn("serial N-042, charge 18 bar", browser.text("#identity"))
        operator.until(lambda line: line.get("type") == "estimate", 30)
        browser.until("document.querySelectorAll('#parameters .plot canvas').length === 4")
        browser.until("document.querySelector('#cycle-which').textContent.includes('accepted')")
        self.assertRegex(browser.text("#progress-text"), r"run 1 of 2, cycle \d+ of 4")
        self.assertIn("pid", browser.text("#identity"))
        self.assertIn("two short runs", browser.text("#identity"))
        self.assertRegex(browser.text("#limit-bars"), r"stroke, mm\s+\d+ … \d+ of 0 … 185; [\d.]+ mm, \d+ % left")
        # The same share as in `watch`: 3 of 15 m/s² are used, none of it at rest.
        self.assertRegex(browser.text("#limit-bars"), r"table, m/s²\s+-\S+ … \S+ of -15 … 15; (79|80) % left")
        before = len(operator.lines)
        operator.until_state("IDLE", start=before, timeout=60)
        browser.until(f"{STATE}.includes('IDLE')")
        browser.until("document.querySelector('#limit-bars').innerText.includes('of -15 … 15; 100 % left')", 5)
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
        self.assertIn("shakerctl ack", browser.text("#alarms h2"))
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
        operator.start({**CAMPAIGN, "runs": CAMPAIGN["runs"][:1] + endless_campaign()["runs"]})
        operator.until(lambda line: line.get("type") == "run_stop" and line["run"] == "slow", 45)
        operator.until(lambda line: line.get("type") == "estimate" and line["run"] == "long", 45)
        late = self.browser(width=820, height=1180, dark=True)
        late.until("document.querySelectorAll('#parameters .plot canvas').length === 4")
        shown = late.value("document.querySelector('#estimate-which').textContent")
        self.assertIn("runs: 2", shown)
        points = late.value("performance.now() > 0 && document.querySelectorAll('#parameters .plot').length")
        self.assertEqual(points, 4)
        self.assertRegex(late.text("#progress-text"), r"run 2 of 2, cycle \d+ of 10000")
        self.assert_clean(late)

    def test_all_of_it_is_seen_at_once_on_a_large_screen(self):
        operator = self.operator()
        operator.start(endless_campaign())
        operator.until(lambda line: line.get("type") == "estimate", 45)
        browser = self.browser(width=1920, height=1280)
        browser.until("document.querySelectorAll('#parameters .plot canvas').length === 4")
        below = browser.value("Math.max(...[...document.querySelectorAll('section')].map("
                              "part => part.getBoundingClientRect().bottom)) - innerHeight")
        self.assertLessEqual(below, 0)
        self.assert_clean(browser)

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

    def choose(self, browser, path):
        """The file that a person gives to the map."""
        root = browser.call("DOM.getDocument")["root"]["nodeId"]
        place = browser.call("DOM.querySelector", nodeId=root, selector="#plan-file")["nodeId"]
        browser.call("DOM.setFileInputFiles", files=[str(path)], nodeId=place)

    def test_the_map_shows_what_a_plan_would_add(self):
        browser = self.browser(width=390, height=844, phone=True)
        operator = self.operator()
        operator.start(endless_campaign())
        operator.until(lambda line: line.get("type") == "cycle" and line["accepted"], 45)
        measured = endless_campaign()["runs"][0]
        plan = self.daemon.directory / "plan.json"
        plan.write_text("// A plan\n" + json.dumps({"name": "next", "runs": [
            {"frequency_hz": 1.001 * measured["frequency_hz"], "amplitude": measured["amplitude"]},
            {"frequency_hz": 4.5, "amplitude": {"from": 1, "to": 4, "steps": 3}}]}))
        self.choose(browser, plan)
        added = "document.querySelector('#plan-said').textContent.includes('next would add 3 of its 4 runs; the others')"
        browser.until(added)
        browser.open("about:blank")
        browser.open(self.gateway.url)  # this browser has kept it
        browser.until(added)
        for name, text, why in (("a.json", "<html>", "is not JSON"), ("b.json", '{"sensors": []}', 'has no "runs"'),
                                ("c.json", '{"runs": [{"frequency_hz": 2}]}', "no run with a frequency and an amplitude")):
            other = self.daemon.directory / name
            other.write_text(text)
            self.choose(browser, other)
            browser.until(f"document.querySelector('#plan-said').textContent.startsWith('{name} ')")
            self.assertIn(why, browser.text("#plan-said"))
            self.assertIn("shakerctl plan --write", browser.text("#plan-said"))
        self.choose(browser, plan)
        browser.until(added)
        browser.value("document.querySelector('#plan-away').click()")
        browser.until("document.querySelector('#plan-said').textContent === ''")
        self.assertIsNone(browser.value("localStorage.getItem('plan of /')"))
        self.assert_clean(browser)

    def test_names_on_the_map_cover_neither_each_other_nor_a_point(self):
        browser = self.browser()
        points = [[20, 80], [24, 78], [40, 76], [60, 76], [64, 30], [66, 31], [67, 32], [68, 33], [69, 34], [300, 100]]
        boxes = browser.value("import('/plane.js').then(({ placesOfLabels }) => { const points = "
                              f"{points}.map(([x, y]) => ({{ x, y, width: 45 }}));"
                              "return placesOfLabels(points, points, { left: 0, right: 320, top: 0, bottom: 120 })"
                              ".map(box => box ?? null); })")
        shown = [box for box in boxes if box]
        self.assertGreaterEqual(len(shown), 4)
        self.assertIsNotNone(boxes[-1])  # it stands alone, at the edge
        self.assertLess(len(shown), len(points))  # there is no room for all of five in a heap
        for i, box in enumerate(shown):
            self.assertTrue(0 <= box["left"] < box["right"] <= 320 and 0 <= box["top"] < box["bottom"] <= 120, box)
            for x, y in points:
                self.assertFalse(box["left"] < x < box["right"] and box["top"] < y < box["bottom"], (box, x, y))
            for other in shown[:i]:
                self.assertTrue(box["left"] >= other["right"] or other["left"] >= box["right"]
                                or box["top"] >= other["bottom"] or other["top"] >= box["bottom"], (box, other))

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
        # The specimen of the campaign that runs, and of none at rest; text that looks like HTML stays text.
        shown = browser.value("""Promise.all([import('/rig.js'), import('/overview.js')]).then(([{ Rig }, { drawState }]) => {
            const rig = new Rig(), specimen = { name: '<b>left</b> gear', serial: 'N-042', charge: '18 bar',
                oil: 'MIL-PRF-5606', temperature: '21 degC', notes: 'new seals' };
            const read = () => [...document.querySelectorAll('#identity > div')].map(one => one.innerText.replace(/\\s+/g, ' '));
            const after = document => { rig.take(document); drawState(rig); return read(); };
            return [after({ type: 'rig', rig: 'a', plan: { campaign: 'c', runs: [], specimen } }),
                    after({ type: 'state', state: 'RAMP', campaign: 'c' }), after({ type: 'state', state: 'IDLE' }),
                    after({ type: 'state', state: 'RAMP', campaign: 'of the next' })]; })""")
        said = ["specimen <b>left</b> gear, serial N-042, charge 18 bar, oil MIL-PRF-5606, 21 degC", "notes new seals"]
        self.assertEqual([[one for one in facts if one.startswith(("specimen", "notes"))] for facts in shown],
                         [[], said, [], []])
        times = browser.value("""import('/words.js').then(({ clockTime }) => {
            const at = new Date(2026, 10, 7, 2, 5, 9), later = new Date(2026, 10, 8, 1, 0, 0);
            return [clockTime(at, new Date(2026, 10, 7, 23)), clockTime(at, later), clockTime("rubbish")]; })""")
        self.assertEqual(times, ["02:05:09", "2026-11-07 02:05:09", ""])
        words = browser.value("""import('/words.js').then(({ measured, figure, duration, bytes }) => [
            measured(16.7234, 0.0521), measured(1234567, 2345), measured(1, NaN), figure(0.000012), figure(NaN),
            duration(3725), duration(61), bytes(70500000000), figure(299.98, 4)])""")
        self.assertEqual(words, ["16.723 ± 0.052", "1234567 ± 2345", "1", "1.200e-5", "–", "1 h 2 min", "1 min 1 s",
                                 "70.5 GB", "300"])


if __name__ == "__main__":
    unittest.main()
