"""Drops by rule: 45 cases against formulas and an integrator that know nothing of the estimator, and bad
input."""
import json
import random
import unittest

from rule_drop import DURATION, G, Gear, by_rule
from support import Scratch, run
from sanitized import SANITIZED

CONDITIONS = [("25.723", "design"), ("25.723", "take-off"), ("25.723", "reserve"), ("23.725", "design"),
              ("23.725", "reserve"), ("27.725", "design"), ("27.725", "reserve"), ("29.725", "design"),
              ("29.725", "reserve")]
MOST_LIFT = {"25.723": 1.0, "23.725": 0.667, "27.725": 2 / 3, "29.725": 2 / 3}


def model(theta):
    t1, t2, t3, t4 = theta
    return {"name": "oleo", "gravity": G, "effects": [
        {"effect": "orifice_damping", "parameters": {"theta1": {"start": t1}}},
        {"effect": "gas_spring", "parameters": {"theta2": {"start": t2}, "theta3": {"start": t3},
                                                "theta4": {"start": t4}}},
        {"effect": "gravity"}]}


class Rules(Scratch):
    def drop(self, *words):
        return run("drop", "--model", self.path / "m.json", *words)

    def drawn_case(self, draw, rule, condition, with_tyre):
        """Numbers of one case, and the options that say them."""
        theta = (draw.uniform(8, 20), draw.uniform(1.2, 3), draw.uniform(3, 5), draw.uniform(1, 1.3))
        shaker_mass = draw.uniform(200, 500)
        weight = G * shaker_mass * draw.uniform(0.8, 1.3)
        reserve = condition == "reserve"
        lift = 1.0 if reserve and rule == "23.725" else \
            draw.uniform(0.2, 1.0 if reserve else MOST_LIFT[rule])
        words = ["--rule", rule, "--condition", condition, "--weight", f"{weight!r}N",
                 "--shaker-mass", repr(shaker_mass), "--lift", repr(lift), "--duration", str(DURATION)]
        more, tyre = {}, None
        if rule == "23.725":
            more["pounds_per_square_foot"] = draw.uniform(4, 35)
            words += ["--wing-loading", f"{more['pounds_per_square_foot']!r}lbf/ft^2"]
        if rule[:2] in ("27", "29") and draw.random() < 0.7:
            more["speed"] = draw.uniform(1.7, 2.8)
            words += ["--sink-speed", repr(more["speed"])]
        if with_tyre:
            tyre = (draw.uniform(0.05, 0.12) * shaker_mass, draw.uniform(300, 900) * weight / G,
                    draw.uniform(0, 4) * weight / G)
            words += ["--unsprung-mass", repr(tyre[0]), "--tyre-stiffness", repr(tyre[1]),
                      "--tyre-damping", repr(tyre[2])]
        return theta, Gear(theta, shaker_mass, tyre), weight, lift, more, words

    def agree_to_a_millionth(self, seed, with_tyre, rounds):
        """As many rounds over all conditions."""
        draw, worst = random.Random(seed), 0.0
        cases = CONDITIONS[::3] if SANITIZED else CONDITIONS * rounds
        for rule, condition in cases:
            theta, gear, weight, lift, more, words = self.drawn_case(draw, rule, condition, with_tyre)
            self.write("m.json", json.dumps(model(theta)))
            result = self.drop(*words, "--json")
            self.assertEqual(result.returncode, 0, result.stderr)
            said = json.loads(result.stdout)
            true = by_rule(gear, rule, condition, weight, lift, **more)
            found = (said["rule"]["height_m"], said["rule"]["effective_weight_N"],
                     said["rule"]["descent_m"], said["rule"]["load_factor"]["value"])
            for name, one, other in zip(("h", "W_e", "d", "n"), found, true):
                self.assertAlmostEqual(one / other, 1.0, delta=1e-6, msg=f"{name} of {words}")
                worst = max(worst, abs(one / other - 1))
            self.assertLess(abs(said["energy_residual"]), 1e-6)
        print(f"{len(cases)} cases, largest difference {worst:.1e}")

    def test_twenty_seven_cases_without_a_tyre(self):
        self.agree_to_a_millionth(21, False, 3)

    def test_eighteen_cases_with_a_tyre(self):
        self.agree_to_a_millionth(22, True, 2)

    def refused(self, *words):
        result = self.drop(*words)
        self.assertEqual(result.returncode, 2, result.stdout)
        self.assertEqual(len(result.stderr.strip().splitlines()), 1, result.stderr)
        return result.stderr

    def test_bad_input_gets_one_sentence(self):
        self.write("m.json", json.dumps(model((15, 1.5, 5, 1.1))))
        rule = ("--rule", "23.725", "--weight", "4kN", "--shaker-mass", "400")
        self.assertIn("23.725 needs --wing-loading", self.refused(*rule))
        loaded = (*rule, "--wing-loading", "18psf")
        self.assertIn("allows a lift of 0 to 0.667", self.refused(*loaded, "--lift", "0.8"))
        self.assertIn("leave --sink-speed out", self.refused(*loaded, "--sink-speed", "2"))
        self.assertIn("has no unit", self.refused(*rule, "--wing-loading", "18"))
        self.assertIn("not a unit", self.refused(*rule, "--wing-loading", "18kg"))
        self.assertIn("has no unit", self.refused("--sink-speed", "2", "--limit", "peak_stroke=0.3"))
        self.assertIn("a load needs --mass",
                      self.refused("--sink-speed", "2", "--limit", "peak_load=12kN"))
        self.assertIn("there is no such limit",
                      self.refused("--sink-speed", "2", "--limit", "settling=3mm"))
        self.assertIn("this gear has no tyre",
                      self.refused("--sink-speed", "2", "--limit", "tyre_deflection=30mm"))
        self.assertIn("how does it fall?", self.refused())
        self.assertIn("--shaker-mass is needed", self.refused("--rule", "29.725", "--weight", "4kN"))
        self.assertIn("--weight", self.refused("--rule", "29.725", "--shaker-mass", "400"))
        self.assertIn("the range of the charge",
                      self.refused("--sink-speed", "2", "--charge", "1.1,0.9"))
        self.assertIn("widen the band of a CAMPAIGN",
                      self.refused("--sink-speed", "2", "--cd-spread", "0.02"))
        self.assertIn("--unsprung-mass",
                      self.refused("--sink-speed", "2", "--tyre-stiffness", "3e5", "--mass", "400"))

    def test_a_drop_that_does_not_turn_is_told(self):
        self.write("m.json", json.dumps(model((0.01, 1.5, 5, 1.1))))
        result = self.drop("--sink-speed", "2", "--duration", "0.02")
        self.assertEqual(result.returncode, 5)
        self.assertIn("longer duration", result.stderr)

    def test_limits_shares_and_pressure_by_hand(self):
        self.write("m.json", json.dumps(model((16, 1.5, 5, 1.1))))
        said = json.loads(self.drop("--sink-speed", "3", "--mass", "400", "--piston-area", "0.004",
                                    "--limit", "peak_load=60kN", "--limit", "peak_load=50kN",
                                    "--limit", "load_factor=15", "--json").stdout)
        # At touch-down: 400 (16 3^2 + 1.5) N, and the gas of 400 1.5 N on 40 cm^2.
        self.assertEqual([limit["met"] for limit in said["limits"]], [True, False, True])
        figures = {f["name"]: f for f in said["figures"]}
        self.assertAlmostEqual(figures["peak_load"]["value"], 400 * 145.5, delta=1e-6)
        shares = {s["effect"]: s for s in said["shares"]}
        self.assertAlmostEqual(shares["orifice_damping"]["of_peak_load"], 144 / 145.5, delta=1e-9)
        self.assertEqual(shares["gas_spring"]["family"], "gas")
        deepest = figures["peak_stroke"]["value"]
        self.assertAlmostEqual(said["gas_pressure_Pa"] / (400 * 1.5 / 0.004 * (1 - 5 * deepest) ** -1.1),
                               1.0, delta=1e-5)
        # Charge and oil: less gas, more stroke; the figures of the least and the greatest are drops too.
        served = json.loads(self.drop("--sink-speed", "3", "--mass", "400", "--charge", "0.9,1.1", "--oil=-0.1,0.1",
                                      "--json").stdout)["servicing"]
        envelope = {f["name"]: f for f in served["figures"]}
        self.assertEqual(served["drops"], 9 + 128)
        self.assertAlmostEqual(envelope["peak_load"]["greatest"], 400 * (144 + 1.1 * 1.5), delta=1e-6)
        self.assertLess(envelope["peak_stroke"]["least"], deepest)
        self.assertGreater(envelope["peak_stroke"]["greatest"], deepest)
        self.assertEqual(envelope["peak_stroke"]["greatest_at"]["charge"], 0.9)
        # A half of the mass falls on the same damper: the same loads in N at touch-down.
        half = json.loads(self.drop("--sink-speed", "3", "--mass", "200", "--shaker-mass", "400",
                                    "--json").stdout)
        self.assertAlmostEqual({f["name"]: f["value"] for f in half["figures"]}["peak_load"],
                               400 * 145.5, delta=1e-6)

    def margin(self, spec, *words):
        self.write("m.json", json.dumps(spec))
        result = self.drop("--sink-speed", "3", "--duration", str(DURATION), "--json", *words)
        self.assertEqual(result.returncode, 0, result.stderr)
        said = json.loads(result.stdout)
        return {f["name"]: f["value"] for f in said["figures"]}["margin_to_bottoming"], said["stroke_end"]

    def test_the_margin_is_to_the_nearest_end_of_the_stroke(self):
        theta = (16, 1.5, 5, 1.1)
        deepest = Gear(theta, 400).drop(400 * G, 3.0, 0.0)[0]
        # The gas is crushed to nothing at 1 / 5 m, a limit is stated, or an end stop is met before.
        margin, end = self.margin(model(theta))
        self.assertAlmostEqual(margin, 0.2 - deepest, delta=1e-6)
        self.assertEqual((end["value"], end["unit"], end["by"]), (0.2, "m", "gas_spring"))
        margin, end = self.margin(model(theta), "--stroke-limit", "190mm")
        self.assertAlmostEqual(margin, 0.19 - deepest, delta=1e-6)
        self.assertEqual(end["by"], "stroke_limit")
        met = deepest + 0.005
        stopped = model(theta)
        stopped["effects"].append({"effect": "end_stop", "parameters": {"u_s": {"start": met}},
                                   "constants": {"w": 1e-4}})
        margin, end = self.margin(stopped, "--stroke-limit", "190mm")
        self.assertAlmostEqual(margin, 0.005, delta=1e-6)
        self.assertEqual(end["by"], "end_stop")
        # A limit that the drop passes: a margin below 0.
        margin, _ = self.margin(model(theta), "--stroke-limit", f"{deepest - 0.01!r}m")
        self.assertAlmostEqual(margin, -0.01, delta=1e-6)
        self.assertIn("has no unit", self.refused("--sink-speed", "3", "--stroke-limit", "0.3"))
        self.assertIn("above 0", self.refused("--sink-speed", "3", "--stroke-limit", "0mm"))
        self.assertIn("--stroke-limit", self.refused("--sink-speed", "3", "--limit", "margin_to_bottoming=1mm"))

    def test_one_value_is_the_state_in_which_it_falls(self):
        self.write("m.json", json.dumps(model((16, 1.5, 5, 1.1))))

        def said(*words):
            result = self.drop("--sink-speed", "3", "--mass", "400", "--json", *words)
            self.assertEqual(result.returncode, 0, result.stderr)
            return json.loads(result.stdout)
        for words, theta, state in (
                (("--charge", "0.9"), (16, 0.9 * 1.5, 5, 1.1), (0.9, 0, 20)),
                (("--charge=0.9", "--oil=-0.1"), (16, 0.9 * 1.5, 5 / 1.1, 1.1), (0.9, -0.1, 20)),
                (("--temperature", "50"), (16 * (1 - 7e-4 * 30), 1.5 * 323.15 / 293.15, 5, 1.1), (1, 0, 50))):
            got = said(*words)
            figures = {f["name"]: f["value"] for f in got["figures"]}
            descent = Gear(theta, 400).drop(400 * G, 3.0, 0.0)[0]
            self.assertAlmostEqual(figures["peak_stroke"], descent, delta=1e-6)
            for key, wanted in zip(("charge", "oil", "temperature_degC"), state):
                self.assertAlmostEqual(got["state"][key], wanted, delta=1e-9)
            self.assertNotIn("servicing", got)
        # A range beside one value: the envelope is about that state.
        served = said("--charge", "0.9", "--oil=-0.1,0.1")["servicing"]
        stroke = {f["name"]: f for f in served["figures"]}["peak_stroke"]
        self.assertAlmostEqual(stroke["greatest_at"]["charge"], 0.9, delta=1e-9)
        self.assertAlmostEqual(
            stroke["greatest"], Gear((16, 1.35, 5 / (1 - stroke["greatest_at"]["oil"]), 1.1), 400)
            .drop(400 * G, 3.0, 0.0)[0], delta=1e-6)
        self.assertNotIn("state", said())
        for wrong in ("0.9,", "0.9,1,1.1", "low", "0.9;1.1"):
            result = self.drop("--sink-speed", "3", f"--charge={wrong}")
            self.assertEqual(result.returncode, 2)
            self.assertIn(f'--charge: "{wrong}" is neither one value nor a range', result.stderr)
        self.assertIn("the range of the charge", self.refused("--sink-speed", "3", "--charge", "-1"))

    def test_every_corner_of_the_servicing_has_an_interval(self):
        theta, error = (16, 1.5, 5, 1.1), 0.4
        self.write("m.json", json.dumps(model(theta)))
        estimate = self.write("e.json", json.dumps({
            "parameters": [{"name": f"theta{i + 1}", "value": value} for i, value in enumerate(theta)],
            "covariance_order": ["theta1"], "covariance": [[error ** 2]], "degrees_of_freedom": 1000000,
            "usable": True}))
        words = ("--estimate", estimate, "--sink-speed", "3", "--mass", "400", "--charge", "0.9,1.1",
                 "--oil=-0.1,0.1")
        result = self.drop(*words, "--json")
        self.assertEqual(result.returncode, 0, result.stderr)
        served = json.loads(result.stdout)["servicing"]
        self.assertEqual(len(served["corners"]), 4)
        half = 2.074 * error  # Student's t of 22 degrees of freedom, at 97.5 %
        strokes = []
        for corner in served["corners"]:
            figures = {f["name"]: f for f in corner["figures"]}
            gas = (1.5 * corner["state"]["charge"], 5 / (1 - corner["state"]["oil"]), 1.1)
            self.assertAlmostEqual(figures["peak_load"]["value"], 400 * (144 + gas[0]), delta=1e-4)
            for end, sign in zip(figures["peak_load"]["interval"], (-1, 1)):
                self.assertAlmostEqual(end - figures["peak_load"]["value"], sign * 400 * 9 * half,
                                       delta=0.05 * 400 * 9 * half)
            # More damping, less stroke: the ends are drops of this file's own integrator.
            true = [Gear((16 + sign * half, *gas), 400).drop(400 * G, 3.0, 0.0)[0] for sign in (1, -1)]
            for end, wanted in zip(figures["peak_stroke"]["interval"], true):
                self.assertAlmostEqual(end, wanted, delta=0.05 * (true[1] - true[0]))
            strokes.append(true)
        worst = {f["name"]: f for f in served["figures"]}["peak_stroke"]
        for end, wanted in zip(worst["greatest_interval"], map(max, zip(*strokes))):
            self.assertAlmostEqual(end, wanted, delta=2e-4)
        for end, wanted in zip(worst["least_interval"], map(min, zip(*strokes))):
            self.assertAlmostEqual(end, wanted, delta=2e-4)
        self.assertIn("95 %", next(line for line in self.drop(*words).stdout.splitlines()
                                   if "peak stroke, greatest" in line))


if __name__ == "__main__":
    unittest.main()
