"""The Python package against the real daemon and the real shakerctl, which share no code with it."""
import csv
import dataclasses
import importlib
import inspect
import json
import os
import pathlib
import sqlite3
import subprocess
import sys
import tempfile
import unittest

HERE = pathlib.Path(__file__).resolve().parent
sys.path[:0] = [str(HERE.parent.parent / "python"), str(HERE.parent / "system")]
import daemon  # noqa: E402
import shakerd  # noqa: E402

SHAKERCTL = os.environ["SHAKERCTL"]
# At 2 and 3 Hz the stroke is long and its transient has died before the first cycle that counts.
CAMPAIGN = {**daemon.CAMPAIGN, "ramp_s": 0.2}
DOUBLE = 1e-9  # of the numbers in shakerctl's CSV, relative


def rows(file):
    with open(file, newline="") as text:
        return list(csv.DictReader(line for line in text if not line.startswith("#")))


class AgainstARig(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.rig = daemon.Daemon().start()
        with shakerd.connect(cls.rig.socket) as client:
            cls.version = client.version
            cls.documents = list(client.run(CAMPAIGN))
        cls.rig.campaign_status()  # it is written to its end
        [cls.file] = cls.rig.databases()

    @classmethod
    def tearDownClass(cls):
        cls.rig.end()

    def test_a_campaign_runs_to_its_end(self):
        self.assertEqual(self.version["type"], "version")
        stops = [d for d in self.documents if d["type"] == "run_stop"]
        self.assertEqual([d["status"] for d in stops], ["success", "success"])
        self.assertEqual(self.documents[-1]["state"], "IDLE")
        with shakerd.connect(self.rig.socket) as client:
            self.assertEqual(client.status()["state"]["state"], "IDLE")

    def test_what_was_seen_is_in_the_file(self):
        seen = [d for d in self.documents if d["type"] == "estimate"]
        with shakerd.open_campaign(self.file) as campaign:
            self.assertEqual(campaign.name, "two short runs")
            self.assertEqual(campaign.status, "success")
            self.assertEqual([(r.name, r.frequency_hz, r.cycles_wanted) for r in campaign.runs],
                             [("slow", 2.0, 4), ("fast", 3.0, 6)])
            self.assertEqual([d["seq"] for d in campaign.documents("estimate")], [d["seq"] for d in seen])
            self.assertEqual(campaign.estimate(), seen[-1])
            self.assertEqual(campaign.channels(), {"displacement": "m", "excitation": "m/s^2"})
            facts = {(fact.of, fact.what): fact for fact in campaign.facts()}
            self.assertEqual(facts["rig file", str(self.rig.rig_file)].value, self.rig.rig_file.read_text())
            self.assertTrue(all(fact.holds() for fact in facts.values()))
            self.assertFalse(dataclasses.replace(facts["host", "name"], value="another").holds())

    def test_samples_and_cycles_are_those_that_shakerctl_exports(self):
        with tempfile.TemporaryDirectory() as folder, shakerd.open_campaign(self.file) as campaign:
            for words in ([], ["--samples"]):
                subprocess.run([SHAKERCTL, "export", str(self.file), "--directory", folder, *words], check=True,
                               stdout=subprocess.DEVNULL)
            exported = sorted(pathlib.Path(folder).glob("*.csv"))
            self.assertGreaterEqual(len(exported), 4, exported)
            for run in campaign.runs:
                own = [f for f in exported if f.stem.split("_")[-1] == run.name or run.name in f.stem]
                samples = next(rows(f) for f in own if "channel" in rows(f)[0])
                for channel in ("displacement", "excitation"):
                    wanted = [(float(r["t"]), float(r["value"])) for r in samples if r["channel"] == channel]
                    t, values = campaign.samples(run.name, channel, bad=True)
                    self.assertEqual(len(t), len(wanted))
                    for (at, value), found_at, found in zip(wanted, t, values):
                        self.assertAlmostEqual(found_at - t[0], at - wanted[0][0], delta=2e-9)
                        self.assertAlmostEqual(found, value, delta=DOUBLE * (1 + abs(value)))
                cycles = next(rows(f) for f in own if "channel" not in rows(f)[0])
                found = [u for c in campaign.cycles(run.name, accepted=True) for u in c.displacement]
                self.assertEqual(len(found), len(cycles))
                for value, row in zip(found, cycles):
                    self.assertAlmostEqual(value, float(row["displacement"]), delta=DOUBLE)

    def test_estimate_and_diagnosis_are_shakerctls(self):
        found = shakerd.estimate(self.file)
        for parameter in found["parameters"]:
            truth = daemon.TRUTH.get(parameter["name"], parameter["value"])
            self.assertLess(abs(parameter["value"] - truth), 6 * parameter["standard_error"], parameter)
        self.assertEqual(shakerd.diagnose(self.file)["effects"], [])

    def test_a_folder_holds_what_was_exported_to_another_program(self):
        with tempfile.TemporaryDirectory() as scratch, shakerd.open_campaign(self.file) as campaign:
            subprocess.run([SHAKERCTL, "export", str(self.file), "--directory", scratch, "--format", "mat"], check=True,
                           stdout=subprocess.DEVNULL)
            [mat] = pathlib.Path(scratch).glob("*.mat")
            folder = pathlib.Path(scratch) / "day"
            self.assertEqual([r["name"] for r in shakerd.import_campaign(mat, folder)["runs"]], ["slow", "fast"])
            day = shakerd.open_folder(folder)
            self.assertEqual((day.name, [r.kind for r in day.runs]), ("two short runs", ["periodic", "periodic"]))
            for run in campaign.runs:
                cycles = list(campaign.cycles(run.name, accepted=True))
                for channel, unit in (("displacement", "m"), ("excitation", "m/s^2")):
                    wanted = [x for cycle in cycles for x in getattr(cycle, channel)]
                    self.assertEqual(list(day[run.name].columns[channel]), wanted)
                    self.assertEqual(day[run.name].units[channel], unit)
            with self.assertRaisesRegex(KeyError, "it has: slow, fast"):
                day["other"]
            # By the model that came with it.
            by_name = {p["name"]: p for p in shakerd.estimate(self.file)["parameters"]}
            for parameter in shakerd.estimate(folder)["parameters"]:
                wanted = by_name[parameter["name"]]
                # From the same cycles, but cut and weighted anew.
                error = max(wanted["standard_error"], parameter["standard_error"])
                self.assertLess(abs(parameter["value"] - wanted["value"]), 3 * error, parameter)

    def test_refusals_are_exceptions_with_the_daemons_sentence(self):
        with shakerd.connect(self.rig.socket) as client:
            with self.assertRaises(shakerd.Refused) as refused:
                client.ask("campaign.start", {"campaign": CAMPAIGN})
            self.assertEqual(refused.exception.code, -32001)
            self.assertIn("control.acquire", str(refused.exception))
            with self.assertRaisesRegex(shakerd.Refused, "frequency_hz"):
                wrong = json.loads(json.dumps(CAMPAIGN))
                wrong["runs"][0]["frequency_hz"] = -1
                next(client.run(wrong))
            with self.assertRaisesRegex(ValueError, "at most 65536"):
                client.ask("campaign.start", {"campaign": {"name": "x" * 70000}})
        with self.assertRaisesRegex(shakerd.ToolFailed, "there is no such campaign"):
            shakerd.estimate("/nowhere.db")


class OfFiles(unittest.TestCase):
    def test_nobody_listens(self):
        with self.assertRaisesRegex(shakerd.ConnectionLost, "is shakerd running"):
            shakerd.connect("/nowhere.sock")

    def test_other_files_are_refused(self):
        with tempfile.TemporaryDirectory() as folder:
            text, other = pathlib.Path(folder) / "a.db", pathlib.Path(folder) / "b.db"
            text.write_text("no database" * 100)
            with sqlite3.connect(other) as database:
                database.execute("CREATE TABLE t(x)")
            for file in (text, other):
                with self.assertRaises(shakerd.NotACampaign):
                    shakerd.open_campaign(file)
            with self.assertRaisesRegex(shakerd.NotACampaign, "is a folder; give one of its databases"):
                shakerd.open_campaign(folder)
        with self.assertRaises(FileNotFoundError):
            shakerd.open_campaign("/nowhere.db")

    def test_a_folder_with_comments_columns_and_units_of_its_own(self):
        with tempfile.TemporaryDirectory() as scratch:
            folder = pathlib.Path(scratch)
            (folder / "a.csv").write_text("t [ms],pos (mm),force\n0,1,2\n1,3,4\n")
            (folder / "campaign.json").write_text("""{"format": "shaker-campaign/1", // of the test bench
                "units": {"force": {"label": "V", "scale": 5}}, "columns": {"displacement": "pos"},
                "runs": [{"name": "a", "kind": "imposed_motion"}]}""")
            [run] = shakerd.open_folder(folder).runs
            self.assertEqual({c: list(v) for c, v in run.columns.items()},
                             {"t": [0, 1], "displacement": [1, 3], "force": [2, 4]})
            self.assertEqual(run.units, {"t": "ms", "displacement": "mm", "force": "V"})
            self.assertIsNone(run.frequency_hz)
            (folder / "campaign.json").write_text('{"runs": 3}')
            with self.assertRaisesRegex(shakerd.NotACampaign, "is no campaign that was recorded"):
                shakerd.open_folder(folder)
            with self.assertRaises(FileNotFoundError):
                shakerd.open_folder(folder / "nowhere")


class WithoutAClient(unittest.TestCase):
    def test_a_caller_that_leaves_the_loop_makes_the_rig_ramp_down(self):
        rig = daemon.Daemon().start()
        try:
            with shakerd.connect(rig.socket) as watcher, shakerd.connect(rig.socket) as client:
                for document in client.run(daemon.endless_campaign()):
                    if document["type"] == "state" and document["state"] == "SETTLE":
                        break
                states = [d["state"] for d in self.until_idle(watcher)]
                self.assertIn("RAMP_DOWN", states)
        finally:
            rig.end()

    def test_a_caller_pauses_and_resumes(self):
        rig = daemon.Daemon().start()
        try:
            states, ended = [], []
            with shakerd.connect(rig.socket) as client:
                for document in client.run(CAMPAIGN):
                    if document["type"] == "run_stop":
                        ended.append(document["status"])
                    if document["type"] != "state" or document["state"] in states[-1:]:
                        continue
                    states.append(document["state"])
                    if states.count("MEASURE") == 1 and states[-1] == "MEASURE":
                        client.pause()
                    if states[-1] == "PAUSE":
                        client.resume()
            self.assertEqual(states[:8], ["IDLE", "CHECK", "RAMP", "SETTLE", "MEASURE", "RAMP_DOWN", "PAUSE", "CHECK"])
            self.assertEqual(states[-1], "IDLE")
            self.assertEqual(ended, ["success", "success"])
        finally:
            rig.end()

    def until_idle(self, watcher):
        moved = False
        for document in watcher.documents(timeout=20):
            if document["type"] == "state":
                yield document
                moved = moved or document["state"] != "IDLE"
                if moved and document["state"] == "IDLE":
                    return
        raise AssertionError("the rig has not come to rest")


class Documented(unittest.TestCase):
    def test_everything_public_has_a_docstring_and_type_hints(self):
        for name in shakerd.__all__:
            thing = getattr(shakerd, name)
            self.assertTrue(inspect.getdoc(thing), name)
            members = inspect.getmembers(thing, inspect.isfunction) if inspect.isclass(thing) else [(name, thing)]
            for member, function in members:
                if member.startswith("_") or not function.__module__.startswith("shakerd"):
                    continue
                self.assertTrue(function.__doc__, f"{name}.{member}")
                hints = inspect.signature(function)
                self.assertIsNot(hints.return_annotation, inspect.Signature.empty, f"{name}.{member}")
                for parameter in hints.parameters.values():
                    if parameter.name != "self":
                        self.assertIsNot(parameter.annotation, inspect.Parameter.empty, f"{name}.{member}")


class StandardLibraryAlone(unittest.TestCase):
    def test_doubles_are_the_same_without_numpy(self):
        module = importlib.import_module("shakerd.campaign")
        kept, module.numpy = module.numpy, None
        try:
            self.assertEqual(list(module._from_blob(b"\0\0\0\0\0\0\xf0\x3f" * 2)), [1.0, 1.0])
        finally:
            module.numpy = kept


if __name__ == "__main__":
    unittest.main()
