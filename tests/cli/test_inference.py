"""Inference on the command line: monte-carlo, plan, and estimate's options."""
import json
import pathlib
import sys
import tempfile
import unittest

from support import EXAMPLES, OLEO_FEET, ROOT, run
from sanitized import some


class MonteCarlo(unittest.TestCase):
    def test_scores_the_papers_experiments(self):
        result = run("monte-carlo", "--figure", 12, "--replications", 300, "--profile", "--json")
        self.assertEqual(result.returncode, 0, result.stderr)
        answer = json.loads(result.stdout)
        self.assertEqual(answer["converged"], 300)
        self.assertEqual([p["name"] for p in answer["parameters"]],
                         ["theta1", "theta2", "theta3", "theta4"])
        for p in answer["parameters"]:
            self.assertGreater(p["coverage"], 0.90)
            self.assertGreater(p["profile_coverage"], 0.90)
            self.assertLess(abs(p["discretisation"]), 1e-3)
        self.assertEqual((answer["bias"], answer["bias_taken_off"], answer["bias_left_in"]), ("auto", 300, 0))
        plain = json.loads(run("monte-carlo", "--figure", 12, "--replications", 300, "--bias", "off",
                               "--json").stdout)
        self.assertEqual((plain["bias"], plain["bias_taken_off"]), ("off", 0))
        self.assertLess(answer["parameters"][3]["scatter"], 0.99 * plain["parameters"][3]["scatter"])
        table = run("monte-carlo", "--figure", 12, "--replications", 20).stdout
        self.assertIn("20 of 20 replications converged", table)

    def test_the_answer_is_the_same_for_any_number_of_threads(self):
        words = ("monte-carlo", EXAMPLES / "model-oleo.json", "--frequency", 1, 2, "--amplitude", 3,
                 "--noise", 1e-4, "--replications", 64, "--json")
        one, three = run(*words, "--threads", 1), run(*words, "--threads", 3)
        self.assertEqual(one.returncode, 0, one.stderr)
        self.assertEqual(one.stdout, three.stdout)

    def test_parts_give_together_what_one_run_gives(self):
        words = ("monte-carlo", "--figure", 12, "--replications", 50, "--profile")
        whole = run(*words, "--json")
        with tempfile.TemporaryDirectory() as folder:
            for count in some((7, 1, 64)):
                files = [pathlib.Path(folder) / f"{count}-{i}.jsonl" for i in range(1, count + 1)]
                for i, file in enumerate(files, 1):
                    made = run(*words, "--shard", f"{i}/{count}", "--keep", file)
                    self.assertEqual(made.returncode, 0, made.stderr)
                merged = run(*words, "--json", "--merge", *reversed(files))
                self.assertEqual(merged.stdout, whole.stdout, f"{count} parts: {merged.stderr}")
            for others, sentence in (((*words, "--merge", *files[1:]), "no file has replication 1; run its part again"),
                                     ((*words, "--merge", *files, files[3]), "replication 4 is there twice"),
                                     ((*words, "--seed", 2, "--merge", *files), "kept with other options"),
                                     ((*words, "--merge", __file__), "not a kept replication"),
                                     ((*words, "--shard", "8/7", "--keep", files[0]), "write 3/7 for the third of")):
                refused = run(*others)
                self.assertEqual(refused.returncode, 2)
                self.assertIn(sentence, refused.stderr)

    def test_says_what_is_missing(self):
        oleo = EXAMPLES / "model-oleo.json"
        for words, sentence in (((), "model file"), ((oleo,), "--frequency"),
                                ((oleo, "--frequency", 1, 2, 3, "--amplitude", 1, 2), "3 frequencies"),
                                ((oleo, "--frequency", 1, "--amplitude", 3), "--noise"),
                                (("--figure", 5), "no figure 5")):
            with self.subTest(words=words):
                result = run("monte-carlo", *words)
                self.assertEqual(result.returncode, 2)
                self.assertIn(sentence, result.stderr)


class Plan(unittest.TestCase):
    def test_ranks_sets_inside_the_rigs_limits_and_draws_them(self):
        with tempfile.TemporaryDirectory() as folder:
            page = pathlib.Path(folder) / "plan.html"
            result = run("plan", EXAMPLES / "model-oleo.json", "--rig",
                         EXAMPLES / "rig-simulated.json", "--draw", page, "--json")
            self.assertEqual(result.returncode, 0, result.stderr)
            text = page.read_text()
            self.assertEqual(text.count("<svg"), 2)
            self.assertRegex(text, r"<th>rig</th><td>simulated</td>")
            self.assertRegex(text, r"<th>planned</th><td>\d{4}-\d\d-\d\d [0-9:]+ UTC by shakerctl \d")
            self.assertIn(">amplitude, m/s²</text>", text)
            self.assertNotRegex(text, r"<th[^>]*>(open)?</th>")
            self.assertIn("the stroke would go up to", text)
            self.assertNotIn("http://", text.replace("http://www.w3.org/2000/svg", ""))
        answer = json.loads(result.stdout)
        sizes = [len(each["runs"]) for each in answer["sets"]]
        self.assertEqual(sizes, sorted(sizes))
        for size in (1, 2, 3):
            spreads = [s["spread"] for s in answer["sets"] if len(s["runs"]) == size]
            self.assertEqual(spreads, sorted(spreads))
        best = {n: min(s["spread"] for s in answer["sets"] if len(s["runs"]) == n) for n in (1, 2, 3)}
        self.assertLess(best[2], best[1])
        self.assertLess(best[3], best[2])
        for candidate in answer["candidates"]:
            if candidate["possible"]:
                self.assertGreaterEqual(candidate["stroke_min"], 0.0)
                self.assertLessEqual(candidate["stroke_max"], 0.185)
        self.assertTrue(any("stroke would go up" in c.get("why", "") for c in answer["candidates"]))
        table = run("plan", EXAMPLES / "model-oleo.json", "--frequencies", 1, 2, "--amplitudes", 3)
        self.assertEqual(table.returncode, 0)
        self.assertIn("best for theta4", table.stdout)

    def test_writes_the_best_set_as_a_campaign_that_the_rig_may_run(self):
        oleo, rig = EXAMPLES / "model-oleo.json", EXAMPLES / "rig-simulated.json"
        with tempfile.TemporaryDirectory() as folder:
            file = pathlib.Path(folder) / "campaign.json"
            words = ("plan", oleo, "--rig", rig, "--runs", 2, "--cycles", 7, "--write", file)
            answer = json.loads(run(*words, "--json").stdout)
            best = min((s for s in answer["sets"] if len(s["runs"]) == 2), key=lambda s: s["spread"])
            written = json.loads(file.read_text())
            self.assertEqual([(r["frequency_hz"], r["amplitude"], r["cycles"]) for r in written["runs"]],
                             [(r["frequency_hz"], r["amplitude"], 7) for r in best["runs"]])
            self.assertEqual(written["model"]["name"], "oleo")
            table = run(*words[:-2]).stdout  # says what the file sets, digit by digit
            self.assertIn(", ".join(f"{r['frequency_hz']:.12g} Hz {r['amplitude']:.12g}" for r in written["runs"]), table)
            check = run("check", file, "--rig", rig)
            self.assertEqual(check.returncode, 0, check.stdout + check.stderr)
            before = file.read_bytes()
            again = run(*words)
            self.assertEqual(again.returncode, 2)
            self.assertIn("campaign.json: exists, and is not replaced", again.stderr)
            self.assertEqual(file.read_bytes(), before)
            # Of a model in feet: 3 ft/s^2.
            model = pathlib.Path(folder) / "feet.json"
            model.write_text(json.dumps(OLEO_FEET))
            other = pathlib.Path(folder) / "feet-campaign.json"
            result = run("plan", model, "--frequencies", 1, 2, "--amplitudes", 3, "--runs", 2, "--write", other)
            self.assertEqual(result.returncode, 0, result.stderr)
            for each in json.loads(other.read_text())["runs"]:
                self.assertEqual(each["amplitude"], 0.9144)

    def test_says_what_is_wrong(self):
        oleo = EXAMPLES / "model-oleo.json"
        for words, sentence in (((oleo,), "--rig"), ((oleo, "--rig", "none.json"), "none.json"),
                                ((oleo, "--frequencies", 0, "--amplitudes", 1), "not positive"),
                                ((oleo, "--frequencies", 2, "--amplitudes", 1e9), "none of the 1 runs")):
            with self.subTest(words=words):
                result = run("plan", *words)
                self.assertEqual(result.returncode, 2)
                self.assertIn(sentence, result.stderr)


class Intervals(unittest.TestCase):
    OLEO = {"name": "oleo", "gravity": 32.178, "length_unit": "ft", "effects": [
        {"effect": "orifice_damping", "parameters": {"theta1": {"start": 5.334}}},
        {"effect": "gas_spring", "parameters": {"theta2": {"start": 5.25}, "theta3": {"start": 1.701},
                                                "theta4": {"start": 1.05}}},
        {"effect": "gravity"}]}

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        self.model = self.folder / "oleo.json"
        self.model.write_text(json.dumps(self.OLEO))
        record = json.loads((ROOT / "tests" / "data" / "verbeek1991.json").read_text())["fig12"]["data_y"]
        self.record = record

    def estimate(self, record, *words):
        file = self.folder / "run.csv"
        file.write_text("t,y\n" + "".join(f"{i / 80},{y!r}\n" for i, y in enumerate(record)))
        result = run("estimate", file, "--model", self.model, "--frequency", 2, "--amplitude", 10,
                     "--json", *words)
        self.assertIn(result.returncode, (0, 5), result.stderr)
        return json.loads(result.stdout)

    def test_of_each_kind_hold_the_estimate(self):
        linear = self.estimate(self.record)
        for kind in ("profile", "bootstrap"):
            other = self.estimate(self.record, "--intervals", kind)
            self.assertEqual(other["intervals"], kind)
            for a, b in zip(linear["parameters"], other["parameters"], strict=True):
                self.assertEqual(a["value"], b["value"])
                low, high = b["interval"]
                self.assertTrue(low < b["value"] < high)
                width = a["interval"][1] - a["interval"][0]
                self.assertAlmostEqual((high - low) / width, 1.0, delta=0.4)

    def test_a_robust_loss_names_the_outlier(self):
        spoilt = list(self.record)
        spoilt[7] += 0.03
        robust = self.estimate(spoilt, "--loss", "huber")
        self.assertTrue(any("run 1 sample 8" in w for w in robust["warnings"]), robust["warnings"])
        clean = self.estimate(self.record)["parameters"][0]
        pulled = self.estimate(spoilt)["parameters"][0]
        self.assertLess(abs(robust["parameters"][0]["value"] - clean["value"]),
                        abs(pulled["value"] - clean["value"]))

    def noisy(self):
        """The record with the uniform noise that the paper speaks of, twice what it has."""
        return [y + 2.5e-4 * (7919 * i % 41 - 20) for i, y in enumerate(self.record)]

    def test_bias_is_taken_off_the_value_and_said(self):
        off, auto = self.estimate(self.noisy(), "--bias", "off"), self.estimate(self.noisy())
        self.assertEqual((off["bias"], auto["bias"]), ("off", "auto"))
        largest = 0.0
        for plain, moved in zip(off["parameters"], auto["parameters"], strict=True):
            self.assertNotIn("bias", plain)
            self.assertAlmostEqual(moved["value"] + moved["bias"], plain["value"], delta=1e-12)
            self.assertEqual(moved["interval"], plain["interval"])
            largest = max(largest, abs(moved["bias"]) / plain["standard_error"])
        self.assertEqual(off["covariance"], auto["covariance"])
        self.assertGreater(largest, 0.05)
        self.assertLess(largest, 0.25)
        words = ("estimate", self.folder / "run.csv", "--model", self.model, "--frequency", 2, "--amplitude", 10)
        self.assertRegex(run(*words).stdout, r"bias taken off: at most 0\.\d+ standard errors")
        self.assertNotIn("bias", run(*words, "--bias", "off").stdout)

    def test_what_follows_the_bend_by_itself_keeps_its_optimum(self):
        off = self.estimate(self.noisy(), "--bias", "off")
        for words in (("--intervals", "profile"), ("--loss", "huber")):
            with self.subTest(words=words):
                document = self.estimate(self.noisy(), *words)
                self.assertEqual(document["bias"], "off")
                self.assertNotIn("bias", document["parameters"][0])
                refused = run("estimate", self.folder / "run.csv", "--model", self.model, "--frequency", 2,
                              "--amplitude", 10, "--bias", "always", *words)
                self.assertEqual(refused.returncode, 2)
                self.assertIn("--bias always", refused.stderr)
        self.assertEqual(self.estimate(self.noisy(), "--intervals", "profile")["parameters"][0]["value"],
                         off["parameters"][0]["value"])
        self.assertEqual(run("estimate", self.folder / "run.csv", "--bias", "sometimes").returncode, 2)
        self.assertEqual(run("completion", "bash").stdout.count("--bias) _shakerctl_reply -W \"auto off always\""), 2)

    def test_choices_that_exclude_each_other_are_refused(self):
        file = self.folder / "run.csv"
        file.write_text("t,y\n")
        result = run("estimate", file, "--loss", "huber", "--intervals", "profile")
        self.assertEqual(result.returncode, 2)
        self.assertIn("squared loss", result.stderr)
        self.assertEqual(run("estimate", file, "--loss", "absolute").returncode, 2)


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], "-v"])
