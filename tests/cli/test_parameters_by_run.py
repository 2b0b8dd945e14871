"""Parameters that are not the same in all runs, against the linear oscillator (6.2) in closed form and normal
equations by hand."""
import contextlib
import json
import math
import random
import sqlite3
import statistics
import subprocess
import unittest

import closed_form
from closed_form import FREQUENCY, fourier, inverse, product, transfer, transposed
from support import MAKE_CAMPAIGN, Scratch, run

C, AMPLITUDE, NOISE, POINTS, CYCLES = 3.0, 1.5, 2e-5, 32, 24
STIFFNESS = {"r01": 120.0, "r02": 140.0, "r03": 165.0}


def by_hand(cycles, stiffness_of, start):
    """theta = (c, further ...) and standard errors by Gauss-Newton on the first harmonics of the mean cycles. White
    noise: the harmonics that the model lacks tell the variance. `stiffness_of(theta, run)` returns the stiffness in
    a run, and its derivatives over theta."""
    theta = list(start)
    n = POINTS * CYCLES
    data = {name: fourier([sum(c[i] for c in own) / CYCLES for i in range(POINTS)], 3)
            for name, own in cycles.items()}
    for _ in range(20):
        rows, left = [], []
        for name, (_, cosine, sine) in data.items():
            k, slopes = stiffness_of(theta, name)
            g, gc, gk, _ = transfer(theta[0], k, 1)
            over = [gc, *[gk * s for s in slopes]]
            rows += [[AMPLITUDE * g_t.real for g_t in over], [-AMPLITUDE * g_t.imag for g_t in over]]
            left += [[cosine - AMPLITUDE * g.real], [sine + AMPLITUDE * g.imag]]
        # A cosine and a sine part of n white samples have the variance 2 s^2 / n.
        covariance = inverse(product(transposed(rows), rows))
        step = product(covariance, product(transposed(rows), left))
        theta = [t + s[0] for t, s in zip(theta, step)]
    squares = 0.0
    for name, own in cycles.items():
        k, _ = stiffness_of(theta, name)
        g = transfer(theta[0], k, 1)[0]
        squares += sum((y - AMPLITUDE * closed_form.wave(g, 1, i / POINTS)) ** 2
                       for c in own for i, y in enumerate(c))
    noise = math.sqrt(squares / (n * len(cycles) - len(theta)))
    return theta, [noise * math.sqrt(2 / n * covariance[k][k]) for k in range(len(theta))]


# Of a standard error: the estimate may leave out a cycle as transient, which the formulas do not.
NEAR = 0.6


class ParametersByRun(Scratch):
    def campaign(self, more=lambda name: {}, stiffness=STIFFNESS):
        folder = self.path / "campaign"
        folder.mkdir(exist_ok=True)
        draw, cycles = random.Random(5), {}
        for name, k in stiffness.items():
            g = transfer(C, k, 1)[0]
            cycles[name] = [[AMPLITUDE * closed_form.wave(g, 1, i / POINTS) + draw.gauss(0, NOISE)
                             for i in range(POINTS)] for _ in range(CYCLES)]
            lines = [f"{i / POINTS / FREQUENCY!r},{y!r}" for i, y in enumerate(y for c in cycles[name] for y in c)]
            (folder / f"{name}.csv").write_text("t,displacement\n" + "\n".join(lines) + "\n")
        (folder / "campaign.json").write_text(json.dumps({"format": "shaker-campaign/1", "runs": [
            {"name": name, "frequency_hz": FREQUENCY, "amplitude": AMPLITUDE, **more(name)} for name in stiffness]}))
        return folder, cycles

    def spring_model(self, **stiffness):
        spec = json.loads(json.dumps(closed_form.MODEL))
        spec["effects"][1]["parameters"]["k"].update(stiffness)
        return self.write("by_run.json", json.dumps(spec))

    def estimate(self, folder, model, status=0):
        result = run("estimate", folder, "--model", model, "--bias", "off", "--json")
        self.assertEqual(result.returncode, status, result.stdout + result.stderr)
        return json.loads(result.stdout) if status == 0 else result.stderr

    def expect(self, found, names, theta, errors):
        by_name = {p["name"]: p for p in found["parameters"]}
        self.assertEqual(set(by_name), set(names))
        for name, value, error in zip(names, theta, errors):
            self.assertAlmostEqual(by_name[name]["value"], value, delta=NEAR * error, msg=name)
            self.assertAlmostEqual(by_name[name]["standard_error"] / error, 1, delta=0.05, msg=name)

    def test_each_run_has_its_own_stiffness(self):
        folder, cycles = self.campaign()
        names = list(STIFFNESS)
        theta, errors = by_hand(cycles, lambda t, name: (t[1 + names.index(name)],
                                                         [float(name == n) for n in names]), [2.5, 125, 135, 160])
        found = self.estimate(folder, self.spring_model(per="run"))
        self.expect(found, ["c", "k[r01]", "k[r02]", "k[r03]"], theta, errors)
        for entry, k, error in zip(found["in_runs"], theta[1:], errors[1:]):
            self.assertAlmostEqual(entry["value"], k, delta=NEAR * error)
            self.assertLess(entry["interval"][0], k)
            self.assertLess(k, entry["interval"][1])
        text = run("estimate", folder, "--model", self.spring_model(per="run")).stdout
        self.assertIn("In each run:", text)

    def test_runs_of_one_group_share_it(self):
        groups = {"r01": "cold", "r02": "warm", "r03": "warm"}
        folder, cycles = self.campaign(lambda name: {"group": groups[name]}, {"r01": 120.0, "r02": 150.0, "r03": 150.0})
        theta, errors = by_hand(cycles, lambda t, name: (t[1 + (name != "r01")],
                                                         [float(name == "r01"), float(name != "r01")]), [2.5, 125, 145])
        self.expect(self.estimate(folder, self.spring_model(per="group")), ["c", "k[cold]", "k[warm]"], theta, errors)

    def test_it_goes_with_the_absolute_temperature(self):
        celsius = {"r01": -20.0, "r02": 20.0, "r03": 60.0}
        kelvin = {name: 273.15 + t for name, t in celsius.items()}
        for inverse_law in (False, True):
            law = {name: (293.15 / kelvin[name] if inverse_law else kelvin[name] / 293.15) for name in celsius}
            folder, cycles = self.campaign(lambda name: {"conditions": {"gas_temperature": f"{celsius[name]} degC"}},
                                           {name: 130 * f for name, f in law.items()})
            theta, errors = by_hand(cycles, lambda t, name: (t[1] * law[name], [law[name]]), [2.5, 125])
            found = self.estimate(folder, self.spring_model(over=("1/" if inverse_law else "") + "gas_temperature",
                                                     reference=293.15))
            self.expect(found, ["c", "k"], theta, errors)
            for entry in found["in_runs"]:
                self.assertAlmostEqual(entry["value"], theta[1] * law[entry["run"]], delta=errors[1])

    def test_a_database_knows_its_channels_and_its_campaign(self):
        g = transfer(C, 130.0, 1)[0]
        table = self.write("table.csv", "".join(
            f"{FREQUENCY},{a}," + ",".join(repr(a * closed_form.wave(g, 1, i / POINTS)) for i in range(POINTS)) + "\n"
            for a in (1.0, 1.5)))
        made = subprocess.run([MAKE_CAMPAIGN, self.path, table, self.spring_model()], capture_output=True, text=True, check=True)
        database = made.stdout.strip()
        plain = {p["name"]: p["value"] for p in self.estimate(database, self.spring_model())["parameters"]}
        self.assertAlmostEqual(plain["k"], 130, delta=0.5)
        # Its channel "gas_pressure" is 1e6 Pa in each run.
        over = self.spring_model(over="gas_pressure", reference=2e6)
        found = self.estimate(database, over)
        self.assertAlmostEqual(found["parameters"][1]["value"] / plain["k"], 2, delta=1e-6)
        self.assertEqual([entry["run"] for entry in found["in_runs"]], ["r01", "r02"])
        with contextlib.closing(sqlite3.connect(database)) as opened, opened:
            opened.execute("UPDATE campaign SET spec_json = ?", (json.dumps({"runs": [
                {"name": "r01", "conditions": {"gas_pressure": "8 MPa"}},
                {"name": "r02", "conditions": {"gas_pressure": 8e6}}]}),))
        self.assertAlmostEqual(self.estimate(database, over)["parameters"][1]["value"] / plain["k"], 0.25, delta=1e-6)

    def test_profile_and_posterior_intervals_know_the_runs(self):
        folder, cycles = self.campaign()
        for kind in ("profile", "posterior"):
            result = run("estimate", folder, "--model", self.spring_model(per="run"), "--intervals", kind, "--json")
            self.assertEqual(result.returncode, 0, result.stderr)
            for p in json.loads(result.stdout)["parameters"]:
                truth = STIFFNESS.get(p["name"][2:5], C)
                self.assertAlmostEqual(p["value"], truth, delta=5 * p["standard_error"], msg=p["name"])

    def test_a_drop_without_a_diagnosis_is_one_more_run(self):
        folder, _ = self.campaign()
        model = self.spring_model(per="run")

        def peak(k):
            damped = math.sqrt(k - C ** 2 / 4)
            return 2 / math.sqrt(k) * math.exp(-C / 2 / damped * math.atan2(damped, C / 2))
        mean = statistics.mean(STIFFNESS.values())
        scatter = statistics.stdev(STIFFNESS.values())
        slope = (peak(mean + 1) - peak(mean - 1)) / 2
        estimate = self.write("estimate.json", json.dumps(self.estimate(folder, model)))
        for source in (("--campaign", folder), ("--estimate", estimate)):
            result = run("drop", *source, "--model", model, "--sink-speed", 2, "--json")
            self.assertEqual(result.returncode, 0, result.stderr)
            figures = {f["name"]: f for f in json.loads(result.stdout)["figures"]}
            self.assertAlmostEqual(figures["peak_stroke"]["value"] / peak(mean), 1, delta=1e-3)
            self.assertAlmostEqual(figures["peak_stroke"]["standard_error"] / abs(slope * scatter), 1, delta=0.02)

    def test_bad_input_gets_one_sentence(self):
        folder, _ = self.campaign()
        for member, said in ((dict(per="group"), "run r01 has no \"group\""),
                             (dict(over="gas_temperature"), "run r01 does not say its gas_temperature"),
                             (dict(per="run", over="mass"), "leave one of the two out"),
                             (dict(per="day"), "run"), (dict(per="run", fixed=True), "stands beside \"fixed\""),
                             (dict(reference=3), "stands beside \"over\" only")):
            self.assertIn(said, self.estimate(folder, self.spring_model(**member), 2), member)
        folder, _ = self.campaign(lambda name: {"conditions": {"gas_temperature": -5}})
        self.assertIn("must be above 0", self.estimate(folder, self.spring_model(over="gas_temperature"), 2))
        folder, _ = self.campaign(lambda name: {"conditions": {"gas_temperature": "5 turnips"}})
        self.assertIn("not a number with a known unit", self.estimate(folder, self.spring_model(over="gas_temperature"), 2))


if __name__ == "__main__":
    unittest.main()
