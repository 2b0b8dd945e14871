"""shakerctl estimate --periods: responses that repeat only after two or three periods of the excitation. The strokes
are those of tests/data/multi_period (extrapolated midpoint steps and shooting in plain Python); the noise is made here."""
import cmath
import json
import math
import pathlib
import random
import sqlite3
import struct
import subprocess
import unittest

from support import DATA, MAKE_CAMPAIGN, Scratch, run

KNOWN = json.loads((DATA / "multi_period" / "reference.json").read_text())
NOISE = 2e-4
RATIO = 0.1  # unsprung mass over the sprung one
CASES = ("oleo_two", "oleo_three", "tyre_two", "tyre_three")


def model_of(name, off):
    """Its starts are every other one `off` above the truth, and the others three fifths of that below it."""
    start = [value * (1 + off if k % 2 == 0 else 1 - 0.6 * off) for k, value in enumerate(KNOWN[name]["theta"])]
    names = ("theta1", "theta2", "theta3", "theta4", "k", "c")
    given = {key: {"start": value} for key, value in zip(names, start)}
    effect = lambda what, *keys: {"effect": what, "parameters": {key: given[key] for key in keys}}
    model = {"name": "oleo", "gravity": 9.80665, "length_unit": "m", "effects": [
        effect("orifice_damping", "theta1"), effect("gas_spring", "theta2", "theta3", "theta4"), {"effect": "gravity"}]}
    if len(start) == 4:
        return model
    for each, acts in zip(model["effects"], (-1, -1, RATIO)):
        each.update(sees=[1, 0], acts=[1, acts])
    for what, key in (("linear_stiffness", "k"), ("viscous_damping", "c")):
        model["effects"].append({**effect(what, key), "sees": [0, 1], "acts": [0, 1]})
    return {**model, "coordinates": ["stroke", "tyre"], "mass": [1, 1, 0, RATIO], "excitation": [1, RATIO],
            "observed": "stroke"}


def stroke_at(name):
    """The reference between its samples: the trigonometric polynomial through them."""
    u = KNOWN[name]["stroke"]
    n = len(u)
    c = [sum(v * cmath.exp(-2j * math.pi * h * i / n) for i, v in enumerate(u)) / n for h in range(n // 2)]
    return lambda tau: c[0].real + 2 * sum((c[h] * cmath.exp(2j * math.pi * h * tau)).real for h in range(1, n // 2))


def repeated(name, cycles, seed=1):
    """Whole cycles of it, noisy, with their times."""
    noise, known = random.Random(seed), KNOWN[name]
    n = len(known["stroke"]) // known["periods"]
    return [(i / n / known["frequency"], known["stroke"][i % len(known["stroke"])] + noise.gauss(0, NOISE))
            for i in range(cycles * n)]


class Records(Scratch):
    def record(self, rows, header="t,y"):
        return self.write("record.csv", header + "\n" + "".join(",".join(map(repr, row)) + "\n" for row in rows))

    def estimate(self, name, file, *words, off=0.05, excited=True):
        model = self.write("model.json", json.dumps(model_of(name, off)))
        known = KNOWN[name]
        amplitude = ("--amplitude", known["amplitude"]) if excited else ()
        return run("estimate", file, "--model", model, "--frequency", known["frequency"], *amplitude, *words)

    def assert_truth(self, name, result, cycles):
        self.assertEqual(result.returncode, 0, result.stdout + result.stderr)
        document = json.loads(result.stdout)
        self.assertTrue(document["usable"])
        self.assertEqual(document["cycles_used"], cycles)
        self.assertAlmostEqual(document["noise_standard_deviation"] / NOISE, 1.0, delta=0.1)
        for parameter, truth in zip(document["parameters"], KNOWN[name]["theta"], strict=True):
            self.assertLess(abs(parameter["value"] - truth), 4 * parameter["standard_error"], parameter["name"])
            self.assertLess(parameter["standard_error"], 0.05 * truth)
        return document


class Periods(Records):
    def test_finds_the_truth_from_records_of_whole_cycles(self):
        for name in CASES:
            for off in (0.05, -0.05, -0.15):
                periods = KNOWN[name]["periods"]
                file = self.record(repeated(name, 10 * periods + 1))
                result = self.estimate(name, file, "--periods", periods, "--json", off=off)
                with self.subTest(name=name, off=off):
                    self.assert_truth(name, result, 10 * periods)

    def test_samples_may_stand_anywhere_and_the_excitation_may_be_measured(self):
        for name in ("oleo_two", "tyre_three"):
            known, at, noise = KNOWN[name], stroke_at(name), random.Random(5)
            rows = []
            for i in range(3000):
                t = 0.1234 + (i + 0.4 * noise.random()) / 733
                tau = t * known["frequency"]
                rows.append((t, known["amplitude"] * math.cos(2 * math.pi * tau) + 0.3 + noise.gauss(0, 0.05),
                             at(tau / known["periods"]) + noise.gauss(0, NOISE)))
            first = math.ceil(rows[0][0] * known["frequency"])
            whole = math.floor(rows[-1][0] * known["frequency"]) - first
            result = self.estimate(name, self.record(rows, "t,excitation,displacement"), "--periods", known["periods"],
                                   "--json", excited=False)
            with self.subTest(name=name):
                self.assert_truth(name, result, whole // known["periods"] * known["periods"])

    def test_prints_values_with_their_intervals_and_knows_other_intervals(self):
        file = self.record(repeated("oleo_two", 20))
        result = self.estimate("oleo_two", file, "--periods", 2)
        self.assertRegex(result.stdout, r"theta1 +16\.\d+ ± 0\.\d+ +16\.\d+ \.\. 16\.\d+  1/m")
        self.assertRegex(result.stdout, r"20 cycles of 1 run")
        linear = json.loads(self.estimate("oleo_two", file, "--periods", 2, "--json").stdout)["parameters"]
        for words in (("--intervals", "profile"), ("--intervals", "bootstrap"), ("--accuracy", "1e-7")):
            other = json.loads(self.estimate("oleo_two", file, "--periods", 2, "--json", *words).stdout)["parameters"]
            for a, b in zip(linear, other, strict=True):
                self.assertLess(abs(a["value"] - b["value"]), a["standard_error"], words)
                width = [p["interval"][1] - p["interval"][0] for p in (a, b)]
                self.assertAlmostEqual(width[0] / width[1], 1.0, delta=0.2)

    def test_without_being_told_it_warns_and_names_the_remedy(self):
        for name, how in (("oleo_two", r"its cycles alternate: odd and even ones differ by \d+ times the noise"),
                          ("oleo_three", r"its cycles repeat only after 3 periods of the excitation")):
            periods = KNOWN[name]["periods"]
            result = self.estimate(name, self.record(repeated(name, 12)))
            self.assertEqual(result.returncode, 5, name)
            self.assertRegex(result.stdout, how)
            self.assertIn(f"say --periods {periods}", result.stdout)
            # A loss that rejects outliers does not make the mean a motion of the damper.
            robust = self.estimate(name, self.record(repeated(name, 12)), "--loss", "huber")
            self.assertEqual(robust.returncode, 5, name)
            self.assertRegex(robust.stdout, how)
            # The same at samples that stand on no grid.
            at, f = stroke_at(name), KNOWN[name]["frequency"]
            rows = [(i / 733, at(i / 733 * f / periods) + NOISE * math.sin(i * i)) for i in range(2000)]
            self.assertRegex(self.estimate(name, self.record(rows)).stdout, how)

    def test_a_response_of_one_period_is_not_doubted(self):
        """Noise, a slow wander of the rig, and a transient that has nearly died."""
        known, noise = KNOWN["oleo_two"], random.Random(3)
        for spoil in (lambda i: 0.0, lambda i: 3e-4 * math.sin(i / 431), lambda i: 2e-3 * math.exp(-i / 300)):
            rows = [(i / 192, known["stroke"][i % 48] + spoil(i) + noise.gauss(0, NOISE)) for i in range(48 * 30)]
            result = self.estimate("oleo_two", self.record(rows), "--json")
            text = " ".join(json.loads(result.stdout).get("warnings", []))
            self.assertNotIn("--periods", text)

    def test_says_what_a_record_does_that_does_not_repeat_as_told(self):
        two = self.record(repeated("oleo_two", 24))
        wrong = self.estimate("oleo_two", two, "--periods", 3)
        self.assertEqual(wrong.returncode, 2)
        self.assertRegex(wrong.stderr, r"does not repeat after 3 periods but after 2: .* say --periods 2")
        known, noise = KNOWN["oleo_two"], random.Random(4)
        one = self.record([(i / 192, known["stroke"][i % 48] + noise.gauss(0, NOISE)) for i in range(48 * 12)])
        wrong = self.estimate("oleo_two", one, "--periods", 2)
        self.assertEqual(wrong.returncode, 2)
        self.assertRegex(wrong.stderr, "repeats after every period.*leave --periods out")
        torus = self.record([(t, y + 0.01 * math.cos(2 * math.pi * 0.618 * 4 * t))
                             for t, y in repeated("oleo_two", 40)])
        wrong = self.estimate("oleo_two", torus, "--periods", 2)
        self.assertEqual(wrong.returncode, 2)
        self.assertRegex(wrong.stderr, r"does not repeat after 2 periods: cycles so far apart differ by 0\.0\d+, \d+ "
                                       r"times the noise; nor does it after 1 to 4 others")
        settling = self.record([(t, y + 0.02 * math.exp(-t)) for t, y in repeated("oleo_two", 40)])
        self.assertIn("it still settles: leave its first cycles out",
                      self.estimate("oleo_two", settling, "--periods", 2).stderr)

    def test_a_frequency_that_is_a_little_off_is_said_with_the_right_one(self):
        """Groups are locked to the excitation: they must not slide along it."""
        known, at, noise = KNOWN["oleo_two"], stroke_at("oleo_two"), random.Random(6)
        for f, off in ((4.0, False), (4.002, True)):
            taus = [i / 733 * f for i in range(733 * 10)]
            rows = [(i / 733, 40 * math.cos(2 * math.pi * tau) + 0.3 + noise.gauss(0, 1.0),
                     at(tau / 2) + noise.gauss(0, NOISE)) for i, tau in enumerate(taus)]
            result = self.estimate("oleo_two", self.record(rows, "t,excitation,displacement"), "--periods", 2,
                                   excited=False)
            self.assertEqual(result.returncode, 2 if off else 0, result.stderr)
            if off:
                self.assertRegex(result.stderr, r"drifts by 0\.0\d+ of a period against 4 Hz .* its frequency is "
                                                r"4\.00[12]\d* Hz; give that with --frequency")

    def test_bad_input_is_2_in_a_sentence(self):
        file = self.record(repeated("oleo_two", 3))
        for word in ("0", "4", "-1", "2.5", "two", "r01=9", "=2"):
            result = self.estimate("oleo_two", file, f"--periods={word}")
            self.assertEqual(result.returncode, 2, word)
            self.assertIn("a response is fitted over 1 to 3 periods", result.stderr, word)
        self.assertIn("3 whole cycles; with --periods 2 at least 4 are needed",
                      self.estimate("oleo_two", file, "--periods", 2).stderr)
        self.assertIn("a CSV file is one run", self.estimate("oleo_two", file, "--periods", "r01=2").stderr)
        file = self.record(repeated("oleo_two", 12))
        for words in (("--objective", "harmonics"), ("--intervals", "posterior"), ("--starts", 4),
                      ("--channels", "displacement,acceleration"), ("--transient",)):
            result = self.estimate("oleo_two", file, "--periods", 2, *words)
            self.assertEqual(result.returncode, 2, words)
            self.assertRegex(result.stderr, "period")
        slow = self.record([row for i, row in enumerate(repeated("oleo_two", 12)) if i % 8 == 0])
        self.assertIn("fewer than 8 samples in a period", self.estimate("oleo_two", slow, "--periods", 2).stderr)

    def test_a_linear_model_has_no_such_response(self):
        model = self.write("linear.json", json.dumps({"name": "spring", "gravity": 9.80665, "effects": [
            {"effect": "viscous_damping", "parameters": {"c": {"start": 0}}}, {"effect": "linear_stiffness"}]}))
        result = run("estimate", self.record(repeated("oleo_two", 12)), "--model", model, "--frequency", 4,
                     "--amplitude", 40, "--periods", 2)
        self.assertEqual(result.returncode, 2)
        self.assertIn('the model "spring" is linear: its response repeats with every period', result.stderr)

    def test_the_option_is_offered(self):
        self.assertIn("--periods", run("estimate", "--help").stdout)
        self.assertRegex(run("completion", "bash").stdout, r"(?s)    estimate\).*?options=\"[^\n]*--periods")


class OfDatabases(Records):
    """The daemon accepts no cycle of such a response, and records them all."""

    def database(self, runs):
        """`runs`: cycles of each, as (index, accepted, displacement)."""
        known = KNOWN["oleo_two"]
        table = self.write("table.csv", f"{known['frequency']},{known['amplitude']},0,0,0,0,0,0,0,0\n" * len(runs))
        model = self.write("own.json", json.dumps(model_of("oleo_two", 0.05)))
        made = subprocess.run([MAKE_CAMPAIGN, str(self.path), str(table), str(model)], capture_output=True, text=True,
                              check=True)
        file = pathlib.Path(made.stdout.strip())
        excitation = [known["amplitude"] * math.cos(2 * math.pi * i / 48) for i in range(48)]
        pack = lambda values: struct.pack(f"<{len(values)}d", *values)
        with sqlite3.connect(file) as database:
            database.execute("DELETE FROM cycle")
            for r, cycles in enumerate(runs):
                for index, accepted, displacement in cycles:
                    database.execute("INSERT INTO cycle VALUES (?, ?, ?, ?, ?, ?, ?, ?, NULL)",
                                     (r, index, accepted, known["frequency"], known["amplitude"], pack(displacement),
                                      pack(excitation), 0.01))
        database.close()
        return file

    def cycles(self, count, first=0, seed=1, settling=0.0):
        y = [value for _, value in repeated("oleo_two", count, seed)]
        return [(first + c, 0, [v + settling * math.exp(-c / 3) for v in y[48 * c:48 * c + 48]]) for c in range(count)]

    def test_takes_the_steady_end_of_what_was_recorded(self):
        file = self.database([self.cycles(60, settling=0.03)])
        result = run("estimate", file, "--periods", 2, "--json")
        cycles = json.loads(result.stdout)["cycles_used"]
        self.assertTrue(30 <= cycles < 56, cycles)
        self.assert_truth("oleo_two", result, cycles)

    def test_a_cycle_that_is_missing_does_not_shift_the_groups(self):
        cycles = self.cycles(41)
        del cycles[10]
        self.assert_truth("oleo_two", run("estimate", self.database([cycles]), "--periods", 2, "--json"), 30)

    def test_runs_are_named_each_or_all_at_once(self):
        file = self.database([self.cycles(20, seed=1), self.cycles(20, seed=2)])
        self.assert_truth("oleo_two", run("estimate", file, "--periods", 2, "--json"), 40)
        self.assert_truth("oleo_two", run("estimate", file, "--periods", "r01=2,r02=2", "--json"), 40)
        self.assert_truth("oleo_two", run("estimate", file, "--periods", "3,r01=2", "--periods", "r02=2", "--json"), 40)
        one = run("estimate", file, "--periods", "r02=2", "--json")
        document = self.assert_truth("oleo_two", one, 20)
        self.assertRegex(" ".join(document["warnings"]), r"run r01, of which no cycle was accepted and none is "
                         r"used: its cycles alternate: .* say --periods r01=2")
        missing = run("estimate", file, "--periods", "r07=2")
        self.assertEqual(missing.returncode, 2)
        self.assertIn('--periods names a run "r07" that there is not', missing.stderr)
        wrong = run("estimate", file, "--periods", "r01=3,r02=2")
        self.assertEqual(wrong.returncode, 2)
        self.assertRegex(wrong.stderr,
                         r"run r01: it does not repeat after 3 periods but after 2: .* say --periods r01=2")

    def test_a_run_of_which_nothing_was_accepted_says_why(self):
        result = run("estimate", self.database([self.cycles(40, settling=0.03)]))
        self.assertEqual(result.returncode, 2)
        self.assertRegex(result.stderr, r"holds no accepted cycle, so there is nothing to estimate from; run r01, of "
                                        r"which no cycle was accepted and none is used: its cycles alternate: .* say "
                                        r"--periods r01=2")


if __name__ == "__main__":
    unittest.main()
