"""estimate's objectives, channels and intervals on the command line, and what bad input is told."""
import itertools
import json
import math
import os
import pathlib
import random
import sqlite3
import subprocess
import tempfile
import unittest

import closed_form
import jsonschema

ROOT = pathlib.Path(__file__).resolve().parents[2]
EXAMPLES = ROOT / "config" / "examples"
CHANNELS = ROOT / "tests" / "data" / "channels"
REFERENCE = json.loads((CHANNELS / "reference.json").read_text())["oleo"]
SHAKERCTL = os.environ["SHAKERCTL"]
MAKE_CAMPAIGN = os.environ["MAKE_CAMPAIGN"]
OLEO = {"name": "oleo", "gravity": 9.80665, "length_unit": "m", "effects": [
    {"effect": "orifice_damping", "parameters": {"theta1": {"start": 16, "lower": 0}}},
    {"effect": "gas_spring", "parameters": {
        "theta2": {"start": 1.6, "lower": 0}, "theta3": {"start": 5.2, "lower": 0},
        "theta4": {"start": 1.1, "lower": 0.2, "upper": 3}}},
    {"effect": "gravity"}]}


def schema():
    """A document of the stream has an envelope, that of shakerctl none."""
    text = json.loads((ROOT / "protocol" / "schema" / "estimate.schema.json").read_text())
    text["required"] = [key for key in text["required"] if key not in ("seq", "t_utc", "t_mono_ns")]
    return jsonschema.Draft202012Validator(text)


def run(*words):
    return subprocess.run([SHAKERCTL, *map(str, words)], capture_output=True, text=True, timeout=120)


class Scratch(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.path = pathlib.Path(folder.name)
        self.model = self.write("oleo.json", json.dumps(OLEO))

    def write(self, name, text):
        (self.path / name).write_text(text)
        return self.path / name

    def changed(self, change):
        model = json.loads(json.dumps(OLEO))
        change(model)
        return self.write("changed.json", json.dumps(model))

    def estimate(self, *words, model=None, file=CHANNELS / "oleo.csv", amplitude=3.048):
        if amplitude is not None:
            words += ("--amplitude", amplitude)
        return run("estimate", file, "--model", model or self.model, "--frequency", 2, *words)

    def document(self, *words, **more):
        result = self.estimate(*words, "--json", **more)
        self.assertEqual(result.returncode, 0, result.stdout + result.stderr)
        document = json.loads(result.stdout)
        schema().validate(document)
        return document


class Objectives(Scratch):
    ALL = ("--channels", "displacement,acceleration,force", "--mass", 1)

    def test_of_several_channels_end_where_independent_code_ends(self):
        for objective, key in (("maximum_likelihood", "independent"), ("joint_covariance", "joint")):
            for more in ((), ("--stagewise",)):
                with self.subTest(objective=objective, more=more):
                    document = self.document(*self.ALL, "--objective", objective, *more)
                    answer = REFERENCE[key]
                    self.assertEqual(document["objective"], objective)
                    for p, theta, error in zip(document["parameters"], answer["theta"],
                                               answer["information_error"], strict=True):
                        self.assertAlmostEqual(p["value"], theta, delta=1e-3 * error)
                    self.assertAlmostEqual(document["log_likelihood"], answer["log_likelihood"], delta=1e-3)
                    self.assertEqual([c["unit"] for c in document["channels"]], ["m", "m/s^2", "N"])
        self.assertGreater(document["noise_correlation"][1][0], 0.4)

    def test_a_heavier_damper_has_the_same_parameters(self):
        lines = (CHANNELS / "oleo.csv").read_text().splitlines()
        heavy = [lines[0]] + [",".join(row.split(",")[:3] + [repr(250 * float(row.split(",")[3]))])
                              for row in lines[1:]]
        words = ("--channels", "displacement,force", "--objective", "maximum_likelihood")
        one = self.document(*words, "--mass", 1)
        many = self.document(*words, "--mass", 250, file=self.write("heavy.csv", "\n".join(heavy)))
        for a, b in zip(one["parameters"], many["parameters"], strict=True):
            self.assertAlmostEqual(a["value"] / b["value"], 1.0, delta=1e-6)
        self.assertAlmostEqual(many["channels"][1]["noise_standard_deviation"] /
                               one["channels"][1]["noise_standard_deviation"], 250.0, delta=0.01)

    def test_of_one_channel_have_their_names(self):
        plain = self.document()
        self.assertEqual((plain["objective"], plain["intervals"], plain["loss"]),
                         ("least_squares", "linear", "squared"))
        squares = self.document("--objective", "least_squares")
        known = self.document("--objective", "weighted", "--noise", 4e-4)
        for a, b, c in zip(plain["parameters"], squares["parameters"], known["parameters"], strict=True):
            self.assertEqual(a["value"], b["value"])
            self.assertAlmostEqual(a["value"] / c["value"], 1.0, delta=1e-7)
            ratio = c["standard_error"] / a["standard_error"]
            self.assertAlmostEqual(ratio, 4e-4 / plain["noise_standard_deviation"], delta=1e-4)
        prior = self.changed(lambda m: m["effects"][1]["parameters"]["theta4"].update(
            prior_mean=1.2, prior_standard_deviation=0.001))
        pulled = self.document("--objective", "map", model=prior)
        self.assertAlmostEqual(pulled["parameters"][3]["value"], 1.2, delta=0.01)
        self.assertEqual(self.document(model=prior)["objective"], "map")
        free = self.document("--objective", "least_squares", model=prior)
        self.assertAlmostEqual(free["parameters"][3]["value"] / plain["parameters"][3]["value"], 1.0, delta=1e-6)

    def test_posterior_intervals_are_close_to_students_where_the_model_is_nearly_linear(self):
        """As wide as Student's, but bent where the parameters of the gas make up for each other."""
        document = self.document("--intervals", "posterior")
        self.assertEqual(len(document["posterior"]), 4)
        sampling = document["posterior_sampling"]
        self.assertEqual((sampling["method"], sampling["converged"]), ("importance", True))
        self.assertLess(sampling["pareto_k"], 0.7)
        self.assertGreaterEqual(sampling["effective_samples"], 400)
        for p, sampled in zip(document["parameters"], document["posterior"], strict=True):
            self.assertEqual(sampled["mode"], p["value"])
            self.assertAlmostEqual(sampled["mean"], p["value"], delta=0.5 * p["standard_error"])
            self.assertGreaterEqual(sampled["effective_samples"], sampling["effective_samples"])
            width = p["interval"][1] - p["interval"][0]
            self.assertAlmostEqual(width / (4.06 * p["standard_error"]), 1.0, delta=0.25)

    def test_what_does_not_go_together_is_said(self):
        for words, sentence in (
                (("--channels", "displacement,force", "--objective", "maximum_likelihood"), "--mass"),
                (("--channels", "displacement,acceleration"), "--objective"),
                (("--channels", "displacement,acceleration", "--objective", "least_squares"), "metres"),
                (("--channels", "displacement,acceleration", "--objective", "weighted", "--noise", 1e-4),
                 "2 channels and 1 standard deviations"),
                (("--objective", "weighted"), "--noise"),
                (("--objective", "map"), "no prior"),
                (("--objective", "harmonics"), "at least 7 whole cycles"),
                (("--objective", "maximum_likelihood", "--intervals", "profile"), "one channel")):
            with self.subTest(words=words):
                result = self.estimate(*words)
                self.assertEqual(result.returncode, 2, result.stdout)
                self.assertIn(sentence, result.stderr)

    def test_harmonics_are_weighed_by_their_own_scatter(self):
        """Noise that a low pass has coloured; the numbers are those of closed_form.py."""
        model = self.write("linear.json", json.dumps(closed_form.MODEL))
        random_ = random.Random(7)
        cycles, noise = [], 0.0
        for _ in range(24):
            cycles.append([])
            for i in range(40):
                noise = 0.9 * noise + random_.gauss(0, 1e-4)
                cycles[-1].append(closed_form.wave(3 * closed_form.transfer(2, 120, 1)[0], 1, i / 40) + noise)
        lines = ["t,y"] + [f"{i / 80!r},{y!r}" for i, y in enumerate(itertools.chain(*cycles))]
        document = self.document("--objective", "harmonics", model=model, amplitude=3,
                                 file=self.write("many.csv", "\n".join(lines)))
        self.assertEqual((document["objective"], document["cycles_used"]), ("harmonics", 24))
        theta, errors = closed_form.fit_harmonics(cycles, 3, 11)  # 23 degrees of freedom, two for each
        for p, value, error in zip(document["parameters"], theta, errors, strict=True):
            self.assertAlmostEqual(p["value"], value, delta=1e-3 * error)
            self.assertAlmostEqual(p["standard_error"] / error, 1.0, delta=1e-3)


class NoisyExcitation(Scratch):
    """The accelerometer on the table has noise: the errors that are stated must know it."""
    NOISE = (2e-5, 5e-3)  # of displacement and acceleration
    TABLE = 0.1           # of the table's accelerometer, one sample
    CYCLES, POINTS = 5, 40
    CHANNELS = ("--channels", "displacement,acceleration")

    def setUp(self):
        super().setUp()
        self.model = self.write("linear.json", json.dumps(closed_form.MODEL))

    def expected(self, excitation_error):
        of_mean = [sigma / math.sqrt(self.CYCLES) for sigma in self.NOISE]
        covariance = closed_form.channel_covariance(2, 120, 3, self.POINTS, of_mean, excitation_error)
        return [math.sqrt(covariance[k][k]) for k in range(2)]

    def measured(self, seed):
        random_ = random.Random(seed)
        lines = ["t,excitation,displacement,acceleration"]
        for i in range(self.CYCLES * self.POINTS):
            tau = i / self.POINTS
            values = [3 * math.cos(2 * math.pi * tau) + random_.gauss(0, self.TABLE)]
            for (transfer, _, _), sigma in zip(closed_form.channels(2, 120, 1), self.NOISE):
                values.append(closed_form.wave(3 * transfer, 1, tau) + random_.gauss(0, sigma))
            lines.append(",".join([repr(tau / closed_form.FREQUENCY)] + [repr(x) for x in values]))
        return self.write("measured.csv", "\n".join(lines))

    def test_widens_the_errors_of_several_channels(self):
        repetitions = 60
        excitation_error = self.TABLE * math.sqrt(2 / (self.CYCLES * self.POINTS))
        expected, alone = self.expected(excitation_error), self.expected(0)
        self.assertGreater(min(e / a for e, a in zip(expected, alone)), 3, "the case shows nothing")
        squares, stated = [0.0, 0.0], [0.0, 0.0]
        for seed in range(repetitions):
            document = self.document(*self.CHANNELS, "--objective", "weighted", "--noise",
                                     ",".join(map(str, self.NOISE)), file=self.measured(seed), amplitude=None)
            for k, (p, truth) in enumerate(zip(document["parameters"], (2, 120), strict=True)):
                squares[k] += (p["value"] - truth) ** 2 / repetitions
                stated[k] += p["standard_error"] / repetitions
        for k in range(2):
            self.assertAlmostEqual(stated[k] / expected[k], 1, delta=0.03)
            self.assertAlmostEqual(math.sqrt(squares[k]) / expected[k], 1, delta=0.3)

    def test_widens_them_with_every_objective(self):
        file = self.measured(99)
        known = self.document(*self.CHANNELS, "--objective", "weighted", "--noise",
                              ",".join(map(str, self.NOISE)), file=file, amplitude=None)
        for objective in ("maximum_likelihood", "joint_covariance"):
            document = self.document(*self.CHANNELS, "--objective", objective, file=file, amplitude=None)
            for p, k in zip(document["parameters"], known["parameters"], strict=True):
                self.assertAlmostEqual(p["standard_error"] / k["standard_error"], 1, delta=0.5)


class Database(Scratch):
    def test_one_channel_likelihood_is_refused_where_nothing_was_recorded(self):
        rows = [line.split(",")[1] for line in (CHANNELS / "oleo.csv").read_text().splitlines()[1:]]
        table = self.write("table.csv", ",".join(["2", "3.048"] + rows) + "\n")
        made = subprocess.run([MAKE_CAMPAIGN, self.path, table, self.model], capture_output=True, text=True,
                              check=True)
        database = made.stdout.strip()
        result = run("estimate", database, "--objective", "joint_covariance", "--channels",
                     "displacement,acceleration")
        self.assertEqual(result.returncode, 2)
        self.assertIn("samples of the", result.stderr)
        weighted = run("estimate", database, "--objective", "weighted", "--json")
        self.assertEqual(weighted.returncode, 0, weighted.stderr)
        schema().validate(json.loads(weighted.stdout))


    def test_channels_come_from_raw_samples_in_phase_with_the_cycles(self):
        """Five periods of raw samples that begin anywhere give what one period as CSV gives."""
        rows = [[float(x) for x in line.split(",")]
                for line in (CHANNELS / "oleo.csv").read_text().splitlines()[1:]]
        table = self.write("table.csv", ",".join(["2", "3.048"] + [repr(row[1]) for row in rows]) + "\n")
        raw = ["t,displacement,acceleration,force"]
        for i in range(13, 213):
            u, a, f = rows[i % 40][1:]
            raw.append(f"{7 + i / 80!r},{u!r},{a!r},{f!r}")
        made = subprocess.run([MAKE_CAMPAIGN, self.path, table, self.model,
                               self.write("raw.csv", "\n".join(raw) + "\n")],
                              capture_output=True, text=True, check=True)
        # The mass is what the campaign's file says.
        result = run("estimate", made.stdout.strip(), "--objective", "joint_covariance",
                     "--channels", "displacement,acceleration,force", "--json")
        self.assertEqual(result.returncode, 0, result.stdout + result.stderr)
        document = json.loads(result.stdout)
        schema().validate(document)
        self.assertEqual((document["campaign"], document["cycles_used"]), ("known", 3))
        for p, theta, error in zip(document["parameters"], REFERENCE["joint"]["theta"],
                                   REFERENCE["joint"]["information_error"], strict=True):
            self.assertAlmostEqual(p["value"], theta, delta=0.1 * error)


    def of_two_channels(self, model):
        """A database of one run with raw samples of a linear oscillator."""
        waves = [[closed_form.wave(3 * t[0], 1, i / 40) for i in range(40)] for t in closed_form.channels(2, 120, 1)]
        table = self.write("table.csv", ",".join(["2", "3"] + list(map(repr, waves[0]))) + "\n")
        raw = ["t,displacement,acceleration"] + [
            f"{7 + i / 80!r},{waves[0][i % 40]!r},{waves[1][i % 40]!r}" for i in range(13, 213)]
        made = subprocess.run([MAKE_CAMPAIGN, self.path, table, model, self.write("raw.csv", "\n".join(raw) + "\n")],
                              capture_output=True, text=True, check=True)
        return made.stdout.strip()

    def test_channels_know_the_recorded_error_of_the_excitation(self):
        """Three cycles with an error of 0.03 m/s^2 each: the mean's is 0.03 / sqrt(3)."""
        model = self.write("linear.json", json.dumps(closed_form.MODEL))
        campaign = self.of_two_channels(model)
        with sqlite3.connect(campaign) as database:
            database.execute("UPDATE cycle SET excitation_error = 0.03")
        database.close()
        noise = (2e-5, 5e-3)
        result = run("estimate", campaign, "--objective", "weighted", "--noise", "2e-5,5e-3",
                     "--channels", "displacement,acceleration", "--json")
        self.assertEqual(result.returncode, 0, result.stdout + result.stderr)
        covariance = closed_form.channel_covariance(2, 120, 3, 40, [s / math.sqrt(3) for s in noise],
                                                    0.03 / math.sqrt(3))
        for k, p in enumerate(json.loads(result.stdout)["parameters"]):
            self.assertAlmostEqual(p["standard_error"] / math.sqrt(covariance[k][k]), 1, delta=0.01)


    def test_channels_tell_what_differs_from_run_to_run(self):
        spec = json.loads(json.dumps(closed_form.MODEL))
        spec["effects"][1]["parameters"]["k"].update({"over": "gas_temperature", "reference": 290})
        model = self.write("over.json", json.dumps(spec))
        campaign = self.of_two_channels(model)
        said = {"runs": [{"name": "r01", "conditions": {"gas_temperature": 348}}]}
        with sqlite3.connect(campaign) as database:
            database.execute("UPDATE campaign SET spec_json = ?", (json.dumps(said),))
        database.close()
        words = ("estimate", campaign, "--model", model, "--objective", "weighted", "--noise", "2e-5,5e-3",
                 "--channels", "displacement,acceleration")
        document = json.loads(run(*words, "--json").stdout)
        stiffness = {p["name"]: p["value"] for p in document["parameters"]}["k"]
        self.assertAlmostEqual(stiffness, 100, delta=0.1)
        [entry] = document["in_runs"]
        self.assertEqual((entry["run"], entry["name"]), ("r01", "k"))
        self.assertAlmostEqual(entry["value"], 1.2 * stiffness, delta=1e-6)
        self.assertIn("In each run:", run(*words).stdout)


class BadInput(Scratch):
    """Each is told what is wrong, where, and what is allowed."""

    def refused(self, sentence, *words, code=2, **more):
        result = self.estimate(*words, **more)
        self.assertEqual(result.returncode, code, result.stdout + result.stderr)
        self.assertRegex(result.stdout + result.stderr, sentence)

    def test_of_bounds_and_starts(self):
        theta1 = lambda m: m["effects"][0]["parameters"]["theta1"]
        self.refused(r'theta1/upper: 2 is not above "lower"',
                     model=self.changed(lambda m: theta1(m).update(lower=5, upper=2)))
        self.refused("theta1/start: 16 is outside of its bounds",
                     model=self.changed(lambda m: theta1(m).update(lower=20, upper=30)))

    def test_of_samples(self):
        lines = (CHANNELS / "oleo.csv").read_text().splitlines()
        for bad, sentence in (("inf", "not a finite number"), ("nan", "not a finite number"),
                              ("", "is not a number")):
            fields = lines[7].split(",")
            fields[1] = bad
            file = self.write("bad.csv", "\n".join(lines[:7] + [",".join(fields)] + lines[8:]))
            self.refused(rf"bad\.csv:8:2: .*{sentence} \(displacement\)", file=file)

    def test_of_a_formula_that_does_not_parse(self):
        self.refused(r"column 8: 'c2' is not known", model=self.changed(lambda m: m["effects"].append(
            {"effect": "mine", "formula": "c1*v + c2*(u", "parameters": {"c1": {"start": 1, "unit": "1/s"}}})))

    def test_of_units_that_do_not_match(self):
        self.refused(r'"length_unit" and "gravity" do not match',
                     model=self.changed(lambda m: m.update(length_unit="ft")))
        lines = (CHANNELS / "oleo.csv").read_text().splitlines()
        file = self.write("mm.csv", "\n".join(
            ["t,y"] + [f"{row.split(',')[0]},{1000 * float(row.split(',')[1])}" for row in lines[1:]]))
        self.refused("do the units match", code=5, file=file)

    def test_of_data_that_do_not_determine_the_model(self):
        twice = self.changed(lambda m: m["effects"].append(
            {"effect": "mine", "formula": "c1*abs(v)*v", "parameters": {"c1": {"start": 1, "unit": "1/m"}}}))
        self.refused("do not determine", code=5, model=twice)

    def test_of_a_model_without_a_periodic_solution(self):
        result = run("estimate", CHANNELS / "oleo.csv", "--model", self.model, "--frequency", 2, "--amplitude",
                     40000)
        self.assertEqual(result.returncode, 5)
        self.assertRegex(result.stderr, r"no periodic solution .* got to \d+\.\d % of it")


if __name__ == "__main__":
    unittest.main()
