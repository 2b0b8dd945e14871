"""estimate's objectives, channels and intervals on the command line, and what bad input is told."""
import json
import math
import os
import pathlib
import subprocess
import tempfile
import unittest

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

    def estimate(self, *words, model=None, file=CHANNELS / "oleo.csv"):
        return run("estimate", file, "--model", model or self.model, "--frequency", 2, "--amplitude", 3.048,
                   *words)

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
        document = self.document("--intervals", "posterior")
        self.assertEqual(len(document["posterior"]), 4)
        for p, sampled in zip(document["parameters"], document["posterior"], strict=True):
            self.assertEqual(sampled["mode"], p["value"])
            self.assertAlmostEqual(sampled["mean"], p["value"], delta=0.5 * p["standard_error"])
            self.assertGreater(sampled["effective_samples"], 200)
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

    def test_harmonics_of_many_cycles_weigh_by_their_own_scatter(self):
        rows = [line.split(",") for line in (CHANNELS / "oleo.csv").read_text().splitlines()[1:]]
        lines = ["t,y"]
        for cycle in range(24):
            for i, row in enumerate(rows):
                noise = 1e-4 * math.sin(1.7 * cycle * (1 + i % 7) + 0.3 * i * cycle + i)
                lines.append(f"{(cycle * 40 + i) / 80!r},{float(row[1]) + noise!r}")
        file = self.write("many.csv", "\n".join(lines))
        document = self.document("--objective", "harmonics", file=file)
        self.assertEqual(document["objective"], "harmonics")
        self.assertEqual(document["cycles_used"], 24)


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
        result = run("estimate", made.stdout.strip(), "--objective", "joint_covariance", "--mass", 1,
                     "--channels", "displacement,acceleration,force", "--json")
        self.assertEqual(result.returncode, 0, result.stdout + result.stderr)
        document = json.loads(result.stdout)
        schema().validate(document)
        self.assertEqual((document["campaign"], document["cycles_used"]), ("known", 3))
        for p, theta, error in zip(document["parameters"], REFERENCE["joint"]["theta"],
                                   REFERENCE["joint"]["information_error"], strict=True):
            self.assertAlmostEqual(p["value"], theta, delta=0.1 * error)


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
