"""Plans that aim at a drop or at one parameter: the promised error against a linear oscillator in closed form,
and what the aim is worth."""
import json
import math
import random
import re
import statistics
import unittest

import closed_form
from closed_form import FREQUENCY, inverse, product, transfer, transposed, wave
from support import EXAMPLES, Scratch, run

C, K, NOISE = 3.0, 150.0, 2e-5


def peak_load(c, k, speed=2.0):
    """The largest c u' + k u of the free decay from u = 0, u' = speed."""
    decay = c / 2
    damped = math.sqrt(k - decay ** 2)

    def load(t):
        u = speed / damped * math.exp(-decay * t) * math.sin(damped * t)
        v = speed * math.exp(-decay * t) * math.cos(damped * t) - decay * u
        return c * v + k * u
    low, high = 0.0, math.pi / damped
    for _ in range(200):
        a, b = low + (high - low) / 3, high - (high - low) / 3
        low, high = (a, high) if load(a) < load(b) else (low, b)
    return load(low)


def covariance(amplitude, points, cycles):
    rows = [[amplitude * wave(g, 1, i / points) for g in transfer(C, K, 1)[1:3]] for i in range(points)]
    information = product(transposed(rows), rows)
    return inverse([[cycles / NOISE ** 2 * x for x in row] for row in information])


class PlanFor(Scratch):
    def setUp(self):
        super().setUp()
        spec = json.loads(json.dumps(closed_form.MODEL))
        spec["effects"][0]["parameters"]["c"]["start"] = C
        spec["effects"][1]["parameters"]["k"]["start"] = K
        self.linear = self.write("linear.json", json.dumps(spec))

    def plan(self, *words, model=None):
        result = run("plan", model or self.linear, "--noise", NOISE, "--json", *words)
        self.assertEqual(result.returncode, 0, result.stderr)
        return json.loads(result.stdout)

    def test_the_promised_error_is_that_of_the_closed_form(self):
        one = ("--frequencies", FREQUENCY, "--amplitudes", 1.5, "--runs", 1, "--points", 32, "--cycles", 20)
        v = covariance(1.5, 32, 20)
        aim = self.plan(*one, "--for", "drop", "--sink-speed", 2)["aim"]
        h = 1e-4
        slope = [(peak_load(C + h, K) - peak_load(C - h, K)) / (2 * h),
                 (peak_load(C, K + h) - peak_load(C, K - h)) / (2 * h)]
        variance = sum(slope[i] * v[i][j] * slope[j] for i in range(2) for j in range(2))
        self.assertAlmostEqual(aim["value"], peak_load(C, K), delta=1e-5)
        self.assertAlmostEqual(aim["sets"][0]["standard_error"] / math.sqrt(variance), 1, delta=1e-3)
        aim = self.plan(*one, "--for", "k")["aim"]
        self.assertAlmostEqual(aim["sets"][0]["standard_error"] / math.sqrt(v[1][1]), 1, delta=1e-3)

    def test_minutes_are_shared_by_the_runs_of_a_set(self):
        found = self.plan("--frequencies", FREQUENCY, "--amplitudes", 1.5, "--runs", 2, "--points", 32,
                          "--minutes", 2, "--for", "k")["aim"]["sets"]
        # 120 s at 2 Hz less 10 cycles to settle; with two runs each settles.
        self.assertEqual([s["cycles"] for s in found], [[230.0], [110.0, 110.0]])
        for cycles, entry in zip((230, 220), found):
            self.assertAlmostEqual(entry["standard_error"] / math.sqrt(covariance(1.5, 32, cycles)[1][1]), 1,
                                   delta=1e-3)

    def test_a_plan_for_the_drop_is_never_worse_and_writes_its_campaign(self):
        draw, ratios = random.Random(9), []
        rig = ("--frequencies", 0.8, 1.2, 1.8, 2.7, 4, "--amplitudes", 1, 2, 3, "--minutes", 5, "--runs", 3)
        for i in range(8):
            model = self.write(f"m{i}.json", json.dumps({"name": "oleo", "effects": [
                {"effect": "orifice_damping", "parameters": {"theta1": {"start": draw.uniform(10, 20)}}},
                {"effect": "gas_spring", "parameters": {"theta2": {"start": draw.uniform(1.2, 2)},
                                                        "theta3": {"start": draw.uniform(4, 6)},
                                                        "theta4": {"start": draw.uniform(1, 1.3)}}},
                {"effect": "gravity"}]}))
            aim = self.plan(*rig, "--for", "drop", "--sink-speed", 3, model=model)["aim"]
            best = min(s["standard_error"] for s in aim["sets"] if s["determined"])
            ratios.append(best / aim["by_volume"][0]["standard_error"])
        self.assertLessEqual(max(ratios), 1 + 1e-9)
        print(f"interval of the drop over that of the plan for the volume: median {statistics.median(ratios):.2f}")
        written = self.path / "campaign.json"
        self.plan(*rig, "--for", "drop", "--sink-speed", 3, "--write", written, model=model)
        runs = json.loads(written.read_text())["runs"]
        chosen = min((s for s in aim["sets"] if s["determined"]), key=lambda s: s["over_prior"])
        self.assertEqual([r["cycles"] for r in runs], [int(c) for c in chosen["cycles"]])
        for value in (r[key] for r in runs for key in ("frequency_hz", "amplitude")):
            self.assertEqual(value, float(f"{value:.3g}"))  # a rig can be set to it, also between the grid's
        self.assertEqual(run("check", written).returncode, 0)

    def test_dampers_without_a_run_leave_the_prior(self):
        # A wide prior of the gas has dampers that rest too near an end of the rig's stroke for any run.
        oleo = EXAMPLES / "model-oleo.json"
        rig = ("--rig", EXAMPLES / "rig-oleosim-modbus.json", "--frequencies", 1, 1.5, 2, 3, "--amplitudes", 0.5, 1,
               "--minutes", 15, "--for", "drop", "--sink-speed", 2)
        narrow = self.plan(*rig, "--prior-spread", 0.001, model=oleo)["aim"]
        self.assertNotIn("warning", narrow)
        wide = self.plan(*rig, "--prior-spread", 0.1, model=oleo)["aim"]
        left_out, dampers = map(int, re.match(r"(\d+) of the (\d+) dampers", wide["warning"]).groups())
        self.assertEqual(dampers, 12)
        self.assertGreater(left_out, 0)
        self.assertLess(left_out, 12)
        self.assertTrue(any(s["determined"] for s in wide["sets"]))
        text = run("plan", oleo, "--noise", NOISE, *rig).stdout
        self.assertEqual(text.count(wide["warning"]), 1)

    def test_bad_input_gets_one_sentence(self):
        rig = ("--frequencies", 2, "--amplitudes", 1)
        for words, said in ((("--for", "drop"), "needs --sink-speed"),
                            (("--for", "theta9"), "say all, drop, or one of c, k"),
                            (("--sink-speed", 3), "belongs to --for drop"),
                            (("--minutes", 0.05), "do not suffice")):
            result = run("plan", self.linear, *rig, *words)
            self.assertEqual(result.returncode, 2, result.stdout)
            self.assertIn(said, result.stderr)


if __name__ == "__main__":
    unittest.main()
