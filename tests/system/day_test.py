"""An operator's day: what was measured and how, what a crash left out, a pause, alarms."""
import contextlib
import hashlib
import json
import os
import re
import sqlite3
import subprocess
import unittest

from daemon import CAMPAIGN, Client, Daemon, RIG, TRUTH

SHAKERCTL = os.environ["SHAKERCTL"]


def campaign(**more):
    return {**json.loads(json.dumps(CAMPAIGN)), **more}


def rig_with_a_weak_table():
    """It answers 15 % too weak, and 5 % less with each minute."""
    rig = json.loads(json.dumps(RIG))
    rig["sensors"][0]["parameters"] = {**TRUTH, "table_gain": 0.85, "table_drift": -0.05 / 60}
    return rig


class Day(unittest.TestCase):
    def setUp(self):
        weak = self._testMethodName == "test_a_weak_table_does_what_was_asked"
        self.daemon = Daemon(rig_with_a_weak_table() if weak else None).start()
        self.addCleanup(self.daemon.end)

    def online(self, *words):
        return subprocess.run([SHAKERCTL, *map(str, words), "--socket", str(self.daemon.socket)],
                              capture_output=True, text=True, timeout=200)

    def offline(self, *words):
        return subprocess.run([SHAKERCTL, *map(str, words)], capture_output=True, text=True, timeout=200)

    def client(self):
        client = Client(self.daemon.socket)
        self.addCleanup(client.close)
        return client

    def file_of(self, spec):
        path = self.daemon.directory / "campaign.json"
        path.write_text(json.dumps(spec))
        return path

    def facts_in(self, file):
        shown = self.offline("show", file, "--json")
        self.assertEqual(shown.returncode, 0, shown.stderr)
        return {(fact["of"], fact["what"]): fact for fact in json.loads(shown.stdout)["facts"]}

    def test_a_database_says_where_its_numbers_come_from(self):
        spec = campaign(specimen={"serial": "N-042", "charge": "18 bar"})
        spec["runs"] = spec["runs"][:1]
        spec["runs"][0]["cycles"] = 12  # whole ones in a row, for a diagnosis
        result = self.online("run", self.file_of(spec), "--specimen", "oil=MIL-PRF-5606", "--specimen",
                             "name=left gear", "--quiet")
        self.assertEqual(result.returncode, 0, result.stderr)
        [file] = self.daemon.databases()
        facts = self.facts_in(file)
        rig = facts["rig file", str(self.daemon.rig_file)]
        self.assertEqual(rig["value"], self.daemon.rig_file.read_text())
        self.assertEqual(rig["sha256"], hashlib.sha256(self.daemon.rig_file.read_bytes()).hexdigest())
        self.assertEqual(facts["specimen", "serial"]["value"], "N-042")
        self.assertEqual(facts["specimen", "oil"]["value"], "MIL-PRF-5606")
        self.assertIn("(pid ", facts["person", "started by"]["value"])
        self.assertEqual(facts["person", "ended because"]["value"], 'campaign "two short runs" is complete')
        self.assertTrue(facts["program", "shakerd"]["value"])
        self.assertEqual(facts["host", "name"]["value"], os.uname().nodename)
        self.assertEqual(json.loads(facts["limits", "in force"]["value"])["stroke_max_m"], 0.185)
        self.assertEqual(self.offline("note", file, "the first of today").returncode, 0)
        report = self.daemon.directory / "report"
        diagnosed = self.offline("diagnose", file, "--out", report)
        self.assertEqual(diagnosed.returncode, 0, diagnosed.stderr)
        page = (report / "report.html").read_text()
        for known in ("N-042", ">left gear, charge 18 bar, oil MIL-PRF-5606<"):
            self.assertIn(known, page)
        self.assertIn(facts["person", "started by"]["value"], page)
        with contextlib.closing(sqlite3.connect(file)) as database, database:
            database.execute("UPDATE campaign SET model_json = replace(model_json, '15.8', '15.9')")
        changed = self.facts_in(file)
        self.assertFalse(changed["model", "as run"]["hash_matches"])
        self.assertTrue(changed["campaign", "as run"]["hash_matches"])
        self.assertIn(": the first of today", self.offline("show", file).stdout)

    def accepted_in(self, file):
        with contextlib.closing(sqlite3.connect(file)) as database:
            return dict(database.execute("SELECT run.name, sum(accepted) FROM cycle JOIN run ON cycle.run = run.idx GROUP BY 1"))

    def on_another_rig(self, first):
        """What was measured on one rig is not resumed on another."""
        self.daemon.kill()
        rig = self.daemon.rig_file.read_text()
        self.daemon.rig_file.write_text(rig.replace('"simulated"', '"another"', 1))
        self.daemon.start()
        refused = self.online("run", "--resume", first)
        self.assertEqual(refused.returncode, 2, refused.stderr)
        self.assertIn('was measured on the rig "simulated"', refused.stderr)
        self.assertIn('moves "another"', refused.stderr)
        self.daemon.kill()
        self.daemon.rig_file.write_text(rig)
        self.daemon.start()

    def test_what_a_crash_left_out_is_measured_into_a_second_file(self):
        operator = self.client()
        operator.start(campaign())
        operator.until(lambda line: line.get("type") == "cycle" and line["run"] == "fast" and line["accepted"], 90)
        self.daemon.kill()
        self.daemon.start()
        after = self.client()
        found = after.until(lambda line: line.get("code") == "campaign_interrupted", 10)
        [first] = self.daemon.databases()
        self.assertIn(f"shakerctl run --resume {first}", found["text"])
        self.on_another_rig(first)
        # It is killed once more, in the middle of what is measured again.
        resumed = subprocess.Popen([SHAKERCTL, "run", "--resume", first, "--socket", self.daemon.socket],
                                   stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
        again = self.client()
        again.until(lambda line: line.get("type") == "cycle" and line["run"] == "fast" and line["accepted"], 90)
        self.daemon.kill()
        [second] = set(self.daemon.databases()) - {first}
        said = resumed.communicate(timeout=30)[1]
        self.assertEqual(resumed.returncode, 3, said)
        self.assertIn(f"measure the rest with `shakerctl run --resume {first} {second}`", said)
        self.daemon.start()
        result = self.online("run", "--resume", first, second)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertIn("run 1 of 1, fast: 3 Hz", result.stdout)
        self.assertEqual(len(re.findall("run fast: success", result.stdout)), 1)
        [third] = set(self.daemon.databases()) - {first, second}
        self.assertIn(f"`shakerctl estimate {first} {second} {third}`", result.stdout)
        self.assertEqual(self.facts_in(third)["campaign", "resumes"]["value"], f"{first.name}, {second.name}")
        kept, cut_short, repeated = (self.accepted_in(file) for file in (first, second, third))
        self.assertEqual((kept["slow"], repeated), (4, {"fast": 6}))
        self.assertTrue(all(1 <= file["fast"] < 6 for file in (kept, cut_short)), (kept, cut_short))
        estimate = self.offline("estimate", first, second, third, "--json")
        self.assertEqual(estimate.returncode, 0, estimate.stderr)
        both = json.loads(estimate.stdout)
        self.assertEqual(both["runs_used"], 4, "the cycles of the runs that were cut short count, too")
        for parameter in both["parameters"]:
            self.assertAlmostEqual(parameter["value"] / TRUTH[parameter["name"]], 1.0, delta=0.02)
        nothing = self.online("run", "--resume", first, second, third)
        self.assertEqual(nothing.returncode, 0, nothing.stderr)
        self.assertIn("Nothing is missing", nothing.stdout)

    def test_a_pause_outlives_its_client_and_moves_nothing(self):
        operator = self.client()
        operator.start(campaign(runs=CAMPAIGN["runs"][1:]))
        operator.until_state("MEASURE", timeout=60)
        paused = self.online("pause")
        self.assertEqual(paused.returncode, 0, paused.stderr)
        operator.until_state("PAUSE")
        refused = self.online("resume")
        self.assertEqual(refused.returncode, 4)
        self.assertIn("has been in control", refused.stderr)
        operator.close()
        onlooker = self.client()
        onlooker.until(lambda line: line.get("code") == "lease_lost", 10)
        mark = len(onlooker.lines)
        onlooker.until(lambda line: len(onlooker.of_type("health")) >= 5, 20)
        moved = [line for line in onlooker.lines[mark:] if line.get("type") == "state" and line["state"] != "PAUSE"]
        self.assertEqual(moved, [])
        result = self.online("resume")
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertIn("run fast: success", result.stdout)
        self.assertEqual(self.daemon.campaign_status(), "success")

    def test_an_alarm_stays_on_every_view_until_it_is_acknowledged(self):
        operator = self.client()
        operator.start(campaign())
        operator.until_state("RAMP", timeout=60)
        self.assertEqual(self.online("estop").returncode, 0)
        late = self.client()
        alarm = late.until(lambda line: line.get("code") == "emergency_stop", 10)
        self.assertEqual(alarm["severity"], "error")
        self.assertRegex(self.online("status").stdout, r"ALARM since \d{4}-\d\d-\d\d [0-9:]+ UTC: emergency stop by ")
        self.assertEqual(json.loads(self.online("status", "--json").stdout)["alarms"], [alarm])
        late.until(lambda _: self.online("ack").returncode == 0, 20)
        late.until(lambda line: line.get("code") == "acknowledged", 10)
        self.assertEqual(json.loads(self.online("status", "--json").stdout)["alarms"], [])

    def test_a_weak_table_does_what_was_asked(self):
        result = self.online("run", self.file_of(campaign()), "--json")
        self.assertEqual(result.returncode, 0, result.stderr)
        lines = [json.loads(line) for line in result.stdout.splitlines()]
        cycles = [line for line in lines if line.get("type") == "cycle"]
        for cycle in cycles:
            if cycle["cycle"] >= 5 or cycle["accepted"]:
                self.assertAlmostEqual(cycle["amplitude"], 3.0, delta=0.03, msg=cycle)
        self.assertGreater(min(cycle["ordered"] for cycle in cycles if cycle["accepted"]), 3.4)
        self.assertIn("amplitude_trimmed", {line.get("code") for line in lines})
        self.assertEqual({line["amplitude"] for line in lines if line.get("state") == "MEASURE" and "run" in line}, {3.0})
