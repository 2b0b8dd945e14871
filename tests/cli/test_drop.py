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


def true_motion(speed, t):
    """Stroke and load per mass of the same drop at time t."""
    decay = DAMPING / 2
    damped = math.sqrt(STIFFNESS - decay ** 2)
    stroke = speed / damped * math.exp(-decay * t) * math.sin(damped * t)
    rate = speed * math.exp(-decay * t) * math.cos(damped * t) - decay * stroke
    return stroke, DAMPING * rate + STIFFNESS * stroke


def stiffer_response(frequency):
    """The stroke of an oscillator with a fifth more stiffness, at an excitation of 2 cos, with noise."""
    omega = 2 * math.pi * frequency
    size = 2.0 / (1.2 * STIFFNESS - omega ** 2 + 1j * omega * DAMPING)
    lines = ["t,excitation,displacement"]
    for i in range(1500):
        t = i / (100 * frequency)
        turned = complex(math.cos(omega * t), math.sin(omega * t))
        lines.append(f"{t:.9f},{2.0 * turned.real:.9f},"
                     f"{(size * turned).real + 1e-5 * math.sin(12345.678 * i * i):.9f}")
    return "\n".join(lines) + "\n"


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

    def test_the_text_says_which_priors_are_in_the_band(self):
        asked = ("drop", self.campaign, "--diagnosis", self.diagnosed(), "--sink-speed", "3")
        self.assertIn("No prior widens the band beyond the tested velocities", self.call(*asked).stdout)
        self.assertIn("0.04 of C_d for each decade", self.call(*asked, "--cd-spread", "0.04").stdout)

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
        for i, frequency in enumerate((0.8, 1.3, 2.1), 1):
            (other / f"r{i}.csv").write_text(response(frequency, seed=1))
        for places in ([self.campaign], [self.campaign, other]):
            result = self.call("estimate", *places, "--model", self.model, "--json")
            self.assertEqual(result.returncode, 0, result.stderr)
            estimate = json.loads(result.stdout)
            values = {p["name"]: p["value"] for p in estimate["parameters"]}
            self.assertAlmostEqual(values["c"], DAMPING, delta=1e-3)
            self.assertAlmostEqual(values["k"], STIFFNESS, delta=1e-2)
            self.assertEqual(estimate["runs_used"], 3 * len(places))

    def measured(self, header, row):
        lines = [",".join(map(repr, row(0.002 * i, *true_motion(2.0, 0.002 * i)))) for i in range(300)]
        return self.write("measured.csv", "\n".join([header, *lines]) + "\n")

    def compared(self, file, *words):
        result = self.call("drop", self.campaign, "--diagnosis", self.out, "--sink-speed", "2",
                           "--measured", file, "--json", *words)
        self.assertEqual(result.returncode, 0, result.stderr)
        measured = json.loads(result.stdout)["measured"]
        return {figure["name"]: figure for figure in measured["figures"]}, measured["in_band"]

    def test_a_measured_drop_is_laid_beside_the_prediction(self):
        self.out = self.diagnosed()
        # In mm and kN of 500 kg; a record of which nothing is wrong.
        mass = ("--mass", 500)
        true = self.measured("t [ms],stroke [mm],load [kN]", lambda t, s, f: (1e3 * t, 1e3 * s, 0.5 * f))
        figures, in_band = self.compared(true, *mass)
        self.assertEqual(set(figures), {"peak_stroke", "time_of_peak_stroke", "peak_load",
                                        "time_of_peak_load", "energy_absorbed"})
        for name, figure in figures.items():
            self.assertLess(abs(figure["error_percent"]), 0.5, name)
        self.assertAlmostEqual(figures["peak_stroke"]["measured"], true_drop(2.0)[0], delta=1e-6)
        self.assertAlmostEqual(figures["energy_absorbed"]["measured"], 0.5 * 500 * 4, delta=1.0)
        self.assertEqual(figures["energy_absorbed"]["unit"], "J")
        # A load that reads 3 % too much: the prediction is 3 % low, and the points leave the band.
        high = self.measured("t,stroke,load [N]", lambda t, s, f: (t, s, 1.03 * 500 * f))
        figures, _ = self.compared(high, *mass)
        self.assertAlmostEqual(figures["peak_load"]["error_percent"], 100 * (1 / 1.03 - 1), delta=0.05)
        self.assertLess(figures["peak_load"]["standard_errors"], -10)
        # An accelerometer on the mass: the model has no weight, so it reads the load.
        moved = self.measured("t,acceleration [g]", lambda t, s, f: (t, f / 9.80665))
        figures, _ = self.compared(moved)
        self.assertAlmostEqual(figures["peak_deceleration"]["error_percent"], 0.0, delta=0.05)
        # Everything is far from the truth: no point lies in the band but those that are 0.
        wrong = self.measured("t,stroke", lambda t, s, f: (t, 2.0 * s))
        _, in_band = self.compared(wrong)
        self.assertEqual(in_band["stroke"]["points"], 300)
        self.assertLess(in_band["stroke"]["inside"], 20)

    def test_a_measured_drop_that_is_wrong_is_told(self):
        drop = ("drop", self.campaign, "--diagnosis", self.diagnosed(), "--sink-speed", "2", "--measured")
        kilo = self.measured("t,load [kN]", lambda t, s, f: (t, f))
        self.assertIn("--mass", self.refused(*drop, kilo))
        self.assertIn("state its unit", self.refused(*drop, self.measured("t,load", lambda t, s, f: (t, f))))
        growing = self.measured("t,stroke", lambda t, s, f: (t, t))
        self.assertIn("does not turn", self.refused(*drop, growing))
        back = self.measured("t,stroke", lambda t, s, f: (-t, s))
        self.assertIn("line 3: t does not grow", self.refused(*drop, back))
        self.assertIn("stroke", self.refused(*drop, self.measured("t,other", lambda t, s, f: (t, s))))

    def test_a_limit_is_met_with_a_probability(self):
        out = self.diagnosed()
        peak = true_drop(2.0)[0]
        result = self.call("drop", self.campaign, "--diagnosis", out, "--sink-speed", "2", "--json",
                           "--limit", f"peak_stroke={1.01 * peak}m", "--limit", f"peak_stroke={990 * peak}mm")
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertEqual([round(limit["probability"], 3) for limit in json.loads(result.stdout)["limits"]],
                         [1.0, 0.0])

    def test_the_margin_to_bottoming_has_an_interval_and_a_probability(self):
        out, peak = self.diagnosed(), true_drop(2.0)[0]
        drop = ("drop", self.campaign, "--diagnosis", out, "--sink-speed", "2")
        # A spring has no end: no figure, and one line that says how to get it.
        self.assertNotIn("margin_to_bottoming", self.call(*drop, "--json").stdout)
        said = [line for line in self.call(*drop).stdout.splitlines() if "--stroke-limit" in line]
        self.assertEqual(len(said), 1)

        def margin(limit):
            result = self.call(*drop, "--stroke-limit", f"{limit!r}m", "--json")
            self.assertEqual(result.returncode, 0, result.stderr)
            found = json.loads(result.stdout)
            figures = {f["name"]: f for f in found["figures"]}
            return figures["margin_to_bottoming"], figures["peak_stroke"], found["bottoming_probability"]
        own, stroke, probability = margin(peak + 0.005)
        low, high = own["interval"]
        self.assertLess(low, 0.005)
        self.assertGreater(high, 0.005)
        width = stroke["interval"][1] - stroke["interval"][0]
        self.assertAlmostEqual(high - low, width, delta=0.02 * width)
        self.assertLess(probability, 1e-3)
        # Between the ends of the peak stroke's interval it is open whether the strut bottoms.
        low, high = stroke["interval"]
        self.assertAlmostEqual(margin(low)[2], 0.975, delta=2e-3)
        self.assertAlmostEqual(margin(high)[2], 0.025, delta=2e-3)
        self.assertAlmostEqual(margin(0.9 * peak)[2], 1.0, delta=1e-12)
        page = self.path / "drop.html"
        self.call(*drop, "--stroke-limit", "300mm", "--page", page)
        self.assertIn("margin to bottoming", page.read_text())
        self.assertIn("left at the peak stroke", page.read_text())

    def test_campaigns_of_two_dampers_are_told(self):
        other = self.path / "other"
        shutil.copytree(self.campaign, other)
        for i, frequency in enumerate((0.8, 1.3, 2.1), 1):
            (other / f"r{i}.csv").write_text(stiffer_response(frequency))
        result = self.call("estimate", self.campaign, other, "--model", self.model, "--json")
        warnings = json.loads(result.stdout)["warnings"]
        said = [w for w in warnings if "do not agree" in w]
        self.assertEqual(len(said), 1, warnings)
        self.assertIn("two dampers", said[0])
        self.assertRegex(said[0], r": k is (99.9|100).* by one and (119.9|120).* by the other")
        self.assertEqual(result.returncode, 6, result.stderr)
        for i, frequency in enumerate((0.8, 1.3, 2.1), 1):
            (other / f"r{i}.csv").write_text(response(frequency, seed=1))
        result = self.call("estimate", self.campaign, other, "--model", self.model, "--json")
        self.assertNotIn("do not agree", result.stdout)

    def test_a_campaign_that_is_given_twice_is_refused(self):
        copy = self.path / "copy"
        shutil.copytree(self.campaign, copy)
        for command in ("estimate", "diagnose", ("drop", "--sink-speed", "2")):
            words = (command,) if isinstance(command, str) else command
            for again in (self.campaign, copy):
                said = self.refused(words[0], self.campaign, again, *words[1:], "--model", self.model)
                self.assertIn("its run r1 has the samples of run r1 of a campaign before it", said)

    def test_a_diagnosis_of_another_campaign_is_refused(self):
        out = self.diagnosed()
        other = self.path / "other"
        shutil.copytree(self.campaign, other)
        (other / "notes.txt").write_text("the same measurements")
        drop = ("drop", other, "--diagnosis", out, "--sink-speed", "2", "--json")
        self.assertEqual(self.call(*drop).returncode, 0)
        self.assertEqual(self.call("drop", "--diagnosis", out, "--sink-speed", "2").returncode, 0)
        (other / "r2.csv").write_text(stiffer_response(1.3))
        said = self.refused(*drop)
        self.assertRegex(said, r"out is the diagnosis of campaign \(data [0-9a-f]{12}\), not of \S*other "
                               r"\(data [0-9a-f]{12}\); give the folder that")
        self.assertIn("leave --diagnosis out", said)
        # The runs of both make another campaign than either.
        self.assertIn(f"{self.campaign} {other}",
                      self.refused("drop", self.campaign, other, "--diagnosis", out, "--sink-speed", "2"))

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
