"""Effects that a further input drives, as the current of a coil: `shakerctl diagnose` names them, and only where the
input has an influence. The motions come from closed forms and from Runge and Kutta's steps of test_scale.py."""
import json
import math
import os
import random
import unittest

from support import Scratch, run
from test_scale import recorded, rounded_sign

CURRENTS = (0.0, 0.5, 1.0, 0.0, 0.5, 1.0)  # A, of the runs
VISCOUS = {"effect": "viscous_damping", "parameters": {"c": {"start": 3.0}}}
SPRING = {"effect": "linear_stiffness", "parameters": {"k": {"start": 60.0}}}


def dynamometer(friction):
    """t, displacement, force of imposed motions; `friction` of the current."""
    source = random.Random(2)
    for current, frequency, half in zip(CURRENTS, (1.0, 1.0, 1.0, 2.5, 2.5, 2.5), (.02, .02, .02, .012, .012, .012)):
        omega, rows = 2 * math.pi * frequency, []
        for i in range(2400):
            t = i / (200 * frequency)
            u, v = half * math.sin(omega * t), half * omega * math.cos(omega * t)
            force = 60 * u + 4 * v + friction(current) * rounded_sign(v, 4e-3) + 0.01 * source.gauss(0, 1)
            rows.append((t, u, force))
        yield current, {"kind": "imposed_motion", "frequency_hz": frequency}, rows


def shaken(damping):
    """t, excitation, displacement of an oscillator; `damping` of the current is what the model takes as constant."""
    for current, frequency, amplitude in zip(CURRENTS, (1.2, 1.2, 1.2, 1.7, 1.7, 1.7), (2.0,) * 6):
        omega, c = 2 * math.pi * frequency, damping(current)

        def table(t, omega=omega, amplitude=amplitude):
            return amplitude * math.cos(omega * t)

        def rate(t, s, table=table, c=c):
            return [s[1], table(t) - 60 * s[0] - c * s[1]]
        rows = recorded(rate, [0.0, 0.0], 26 / frequency, 60 * frequency, table)
        kept = rows[12 * 60:]
        yield current, {"frequency_hz": frequency, "amplitude": amplitude}, [(t - kept[0][0], x, u) for t, x, u in kept]


def decays(friction):
    """t, displacement of a mass that is let go."""
    for current, start in ((0.0, 0.08), (0.5, 0.08), (1.0, 0.08)):
        def rate(t, s, f=friction(current)):
            return [s[1], -60 * s[0] - 0.4 * s[1] - f * rounded_sign(s[1], 2e-4)]
        yield current, {"kind": "transient"}, recorded(rate, [start, 0.0], 6, 100)


class Input(Scratch):
    def campaign(self, header, runs, effects, column=None, **more):
        """`column(current, i)` gives sample i of the measured current; without it each run states its number."""
        listed = []
        for i, (current, said, rows) in enumerate(runs, 1):
            measured = [(*row, column(current, k)) for k, row in enumerate(rows)] if column else rows
            lines = [",".join(f"{x:.13e}" for x in row) for row in measured]
            names = header + ",coil [A]" if column else header
            self.write(f"r{i}.csv", "\n".join([names, *lines]) + "\n")
            stated = {} if column else {"conditions": {"current": current}}
            listed.append({"name": f"r{i}", **said, **stated})
        if column:
            more["columns"] = {"current": "coil"}
        self.write("campaign.json", json.dumps({"format": "shaker-campaign/1", "input": "current", "runs": listed,
                                                **more}))
        self.model = self.write("model.json", json.dumps({"name": "plain", "effects": effects}))

    def shakerctl(self, *words, status=0):
        result = run(*words, env={**os.environ, "XDG_CACHE_HOME": str(self.path / "cache")})
        self.assertEqual(result.returncode, status, result.stdout + result.stderr)
        return result

    def answer(self, *words):
        return json.loads(self.shakerctl("diagnose", self.path, "--model", self.model, "--json", *words).stdout)

    def names(self, said):
        return sorted(e["name"] for e in said["effects"])

    def test_friction_that_grows_with_the_current_is_named(self):
        self.campaign("t,displacement,force", dynamometer(lambda i: 0.3 + 0.8 * i), [VISCOUS, SPRING])
        said = self.answer("--out", self.path / "out")
        self.assertEqual((said["verdict"], self.names(said)),
                         ("explained", ["coulomb_friction", "coulomb_friction over current"]))
        self.assertLess(said["gap"]["after"], 0.1 * said["gap"]["before"])
        (driven,) = (e for e in said["effects"] if e["name"].endswith("over current"))
        self.assertIn("in proportion to current", driven["meaning"])
        # At the largest current, 1 A; the width of both may stand with either.
        (value,) = (p for p in driven["parameters"] if p["name"] == "f_c[current]")
        self.assertAlmostEqual(value["value"], 0.8, delta=0.008)
        self.assertLess(value["standard_error"], 0.02)
        # Both parts reverse over one width, which is not the catalogue's.
        after = {p["name"]: p["value"] for p in said["parameters_after"]}
        self.assertEqual(sorted(after), ["c", "e", "f_c", "f_c[current]", "k"])
        self.assertAlmostEqual(after["e"], 4e-3, delta=2e-4)
        # The files: the model, the hypotheses and the page.
        lines = json.loads((self.path / "out" / "model.json").read_text())["effects"]
        (line,) = (e for e in lines if "input" in e)
        self.assertEqual((line["effect"], line["input"], line["reference"]), ("coulomb_friction", "current", 1.0))
        self.assertEqual([e["constants"]["e"] for e in lines if e["effect"] == "coulomb_friction"], [after["e"]] * 2)
        best = json.loads((self.path / "out" / "hypotheses.json").read_text())["hypotheses"][0]
        self.assertIn("coulomb_friction over current", best["effects"])
        self.assertIn("coulomb_friction over current", (self.path / "out" / "report.html").read_text())

    def test_friction_that_the_current_alone_makes_is_named(self):
        self.campaign("t,displacement,force", dynamometer(lambda i: 0.8 * i), [VISCOUS, SPRING],
                      column=lambda current, k: current)
        said = self.answer()
        self.assertEqual((said["verdict"], self.names(said)), ("explained", ["coulomb_friction over current"]))

    def test_a_current_without_influence_is_not_named(self):
        self.campaign("t,displacement,force", dynamometer(lambda i: 0.5), [VISCOUS, SPRING])
        said = self.answer()
        self.assertEqual((said["verdict"], self.names(said)), ("explained", ["coulomb_friction"]))
        self.assertGreater(said["effects"][0]["probability"], 0.9)
        self.campaign("t,displacement,force", dynamometer(lambda i: 0.0), [VISCOUS, SPRING])
        self.assertEqual(self.answer()["verdict"], "adequate")

    def test_damping_of_the_model_that_grows_with_the_current_is_named(self):
        self.campaign("t,excitation,displacement", shaken(lambda i: 2.0 + 1.5 * i), [VISCOUS, SPRING])
        said = self.answer()
        self.assertEqual((said["verdict"], self.names(said)), ("explained", ["viscous_damping over current"]))
        (value,) = said["effects"][0]["parameters"]
        self.assertAlmostEqual(value["value"], 1.5, delta=0.05)
        self.campaign("t,excitation,displacement", shaken(lambda i: 2.0), [VISCOUS, SPRING])
        self.assertEqual(self.answer()["verdict"], "adequate")

    def test_records_show_an_input_too(self):
        self.campaign("t,displacement", decays(lambda i: 0.03 * i), [VISCOUS, SPRING])
        said = self.answer()
        self.assertEqual(said["effects"][0]["name"], "coulomb_friction over current")

    def test_a_current_that_varies_within_a_run_is_told(self):
        self.campaign("t,displacement,force", dynamometer(lambda i: 0.3 + 0.8 * i), [VISCOUS, SPRING],
                      column=lambda current, k: current * (1 + 0.5 * math.sin(0.1 * k)))
        said = self.answer()
        self.assertFalse([n for n in self.names(said) if "over" in n])
        told = {n["name"]: n["reason"] for n in said["not_tried"]}
        self.assertIn("varies within run", told["coulomb_friction over current"])

    def test_a_current_that_is_the_same_in_all_runs_is_told(self):
        self.campaign("t,displacement,force", ((0.7, said, rows) for _, said, rows in dynamometer(lambda i: 0.5)),
                      [VISCOUS, SPRING])
        told = {n["name"]: n["reason"] for n in self.answer()["not_tried"]}
        self.assertEqual(told["coulomb_friction over current"], "current is 0.7 in all runs")

    def test_the_current_of_a_run_that_is_left_out_tells_nothing(self):
        self.campaign("t,displacement", ((current, said, [(t + 3 * (k // 20 if current < 1 else 0), u)
                                                          for k, (t, u) in enumerate(rows)])
                                         for current, said, rows in decays(lambda i: 0.03)), [VISCOUS, SPRING])
        said = self.answer()
        self.assertEqual(len(said["runs"]), 1, "most samples of the other two are missing")
        told = {n["name"]: n["reason"] for n in said["not_tried"]}
        self.assertEqual(told["coulomb_friction over current"], "current is 1 in all runs")

    def test_a_run_without_its_current_is_refused(self):
        self.campaign("t,displacement,force", dynamometer(lambda i: 0.5), [VISCOUS, SPRING])
        campaign = json.loads((self.path / "campaign.json").read_text())
        del campaign["runs"][2]["conditions"]
        self.write("campaign.json", json.dumps(campaign))
        refused = self.shakerctl("diagnose", self.path, "--model", self.model, status=2)
        self.assertIn("r3.csv", refused.stderr)
        self.assertIn("current", refused.stderr)
        campaign["input"] = "force"
        self.write("campaign.json", json.dumps(campaign))
        refused = self.shakerctl("diagnose", self.path, "--model", self.model, status=2)
        self.assertIn("not the name of a further input", refused.stderr)


if __name__ == "__main__":
    unittest.main()
