"""From a campaign's folder to a drop: estimate, diagnosis, prediction. The truth is the linear
oscillator in closed form."""
import json
import math
import os
import shutil
import unittest

from support import Scratch, run
from test_diagnose import MODEL, response

DAMPING, STIFFNESS = 2.0, 100.0


def true_drop(speed):
    """Peak stroke and its time of u'' + c u' + k u = 0 from u = 0, u' = speed."""
    natural, decay = math.sqrt(STIFFNESS), DAMPING / 2
    damped = math.sqrt(natural ** 2 - decay ** 2)
    time = math.atan2(damped, decay) / damped
    return speed / natural * math.exp(-decay * time), time


class Drop(Scratch):
    def setUp(self):
        super().setUp()
        self.campaign = self.path / "campaign"
        self.campaign.mkdir()
        runs = []
        for i, frequency in enumerate((0.8, 1.3, 2.1), 1):
            (self.campaign / f"r{i}.csv").write_text(response(frequency))
            runs.append({"name": f"r{i}", "frequency_hz": frequency, "amplitude": 2.0})
        (self.campaign / "campaign.json").write_text(
            json.dumps({"format": "shaker-campaign/1", "runs": runs}))
        self.model = self.write("model.json", json.dumps(MODEL))

    def call(self, *words):
        return run(*words, env={**os.environ, "XDG_CACHE_HOME": str(self.path / "cache")})

    def diagnosed(self):
        out = self.path / "out"
        made = self.call("diagnose", self.campaign, "--model", self.model, "--out", out)
        self.assertEqual(made.returncode, 0, made.stderr)
        return out

    def refused(self, *words):
        result = self.call(*words)
        self.assertEqual(result.returncode, 2, result.stdout)
        return result.stderr

    def test_the_interval_of_a_drop_holds_the_closed_form(self):
        out = self.diagnosed()
        for speed in (1.0, 3.0):
            result = self.call("drop", self.campaign, "--diagnosis", out, "--sink-speed", speed, "--json")
            self.assertEqual(result.returncode, 0, result.stderr)
            drop = json.loads(result.stdout)
            figures = {figure["name"]: figure for figure in drop["figures"]}
            for name, truth in zip(("peak_stroke", "time_of_peak_stroke"), true_drop(speed)):
                low, high = figures[name]["interval"]
                self.assertLess(low, truth, name)
                self.assertGreater(high, truth, name)
                self.assertLess(high - low, 1e-3 * truth, name)
            self.assertEqual(figures["peak_load"]["unit"], "m/s^2")
            for name in ("efficiency", "energy_absorbed", "time_of_peak_load"):
                self.assertIn("interval", figures[name])
            self.assertGreater(drop["extrapolated_energy_share"], 0.1)
            self.assertLessEqual(drop["extrapolated_energy_share"], 1.0)

    def test_without_a_diagnosis_it_makes_one(self):
        given = self.call("drop", self.campaign, "--diagnosis", self.diagnosed(), "--sink-speed", "2", "--json")
        made = self.call("drop", self.campaign, "--model", self.model, "--sink-speed", "2", "--json")
        self.assertEqual(made.returncode, 0, made.stderr)
        first, second = json.loads(given.stdout), json.loads(made.stdout)
        for one, other in zip(first["figures"], second["figures"]):
            self.assertAlmostEqual(one["value"] / other["value"] if other["value"] else 1.0, 1.0, delta=1e-9)

    def test_every_hypothesis_has_a_probability_and_a_covariance(self):
        damper = json.loads((self.diagnosed() / "hypotheses.json").read_text())
        self.assertAlmostEqual(sum(h["probability"] for h in damper["hypotheses"]), 1.0, delta=1e-12)
        for hypothesis in damper["hypotheses"]:
            size = len(hypothesis["estimate"]["parameters"])
            self.assertEqual([len(row) for row in hypothesis["estimate"]["covariance"]], size * [size])
        found = {p["name"]: p for p in damper["hypotheses"][0]["estimate"]["parameters"]}
        self.assertAlmostEqual(found["c"]["value"], DAMPING, delta=1e-3)
        self.assertAlmostEqual(found["k"]["value"], STIFFNESS, delta=1e-2)

    def test_estimate_takes_a_folder_and_several(self):
        other = self.path / "again"
        shutil.copytree(self.campaign, other)
        for places in ([self.campaign], [self.campaign, other]):
            result = self.call("estimate", *places, "--model", self.model, "--json")
            self.assertEqual(result.returncode, 0, result.stderr)
            estimate = json.loads(result.stdout)
            values = {p["name"]: p["value"] for p in estimate["parameters"]}
            self.assertAlmostEqual(values["c"], DAMPING, delta=1e-3)
            self.assertAlmostEqual(values["k"], STIFFNESS, delta=1e-2)
            self.assertEqual(estimate["runs_used"], 3 * len(places))

    def test_what_is_no_campaign_or_no_diagnosis_is_told(self):
        empty = self.path / "empty"
        empty.mkdir()
        drop = ("drop", self.campaign, "--sink-speed", "2")
        self.assertIn("give --model MODEL.json", self.refused(*drop))
        self.assertIn("hypotheses.json: cannot be read", self.refused(*drop, "--diagnosis", empty))
        (empty / "hypotheses.json").write_text('{"format": "shaker-damper/1"}')
        self.assertIn("diagnose again", self.refused(*drop, "--diagnosis", empty))
        self.assertIn("there is no such campaign",
                      self.refused("drop", self.path / "nothing", "--sink-speed", "2"))
        self.assertIn("must be above 0",
                      self.refused("drop", "--diagnosis", self.diagnosed(), "--sink-speed", "-1"))


if __name__ == "__main__":
    unittest.main()
