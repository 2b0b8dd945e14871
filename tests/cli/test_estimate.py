"""shakerctl estimate, export and compare."""
import csv
import json
import math
import pathlib
import subprocess
import sys
import unittest

from support import DATA, EXAMPLES, MAKE_CAMPAIGN, OLEO_FEET, Scratch, run


def reference(name):
    rows = {}
    for line in (DATA / name).read_text().splitlines():
        key, *numbers = line.split(",")
        rows[key] = [float(number) for number in numbers]
    return rows


class Estimate(Scratch):
    def test_data_without_motion_get_words_and_no_figures(self):
        rows = "".join(f"{i * 0.005},{3 * math.cos(4 * math.pi * i * 0.005)},%s\n" % "{}" for i in range(200))
        flat = self.write("flat.csv", "t,excitation,displacement\n" + rows.replace("{}", "0.15"))
        model = EXAMPLES / "model-oleo.json"
        result = run("estimate", flat, "--model", model, "--frequency", 2)
        self.assertEqual(result.returncode, 5, result.stderr)
        theta1 = next(line for line in result.stdout.splitlines() if line.startswith("theta1"))
        self.assertIn("not determined", theta1)
        self.assertNotRegex(theta1, r"e\+1\d")
        document = json.loads(run("estimate", flat, "--model", model, "--frequency", 2, "--json").stdout)
        self.assertFalse(document["usable"])
        self.assertNotIn("standard_error", document["parameters"][0])
        self.assertFalse(document["parameters"][0]["determined"])
        huge = self.write("huge.csv", "t,excitation,displacement\n" + "".join(
            f"{i * 0.005},{3 * math.cos(4 * math.pi * i * 0.005)},{1e300 * math.sin(i)}\n" for i in range(200)))
        result = run("estimate", huge, "--model", model, "--frequency", 2)
        self.assertEqual(result.returncode, 5, result.stderr)
        self.assertNotRegex(result.stdout, r"\binf\b")

    def estimate(self, file, *words):
        return run("estimate", file, "--model", self.model, "--frequency", 2, "--amplitude", 10, *words)

    def test_finds_the_optimum_of_an_independent_solver(self):
        result = self.estimate(DATA / "oleo_j1.csv", "--json")
        self.assertEqual(result.returncode, 0, result.stderr)
        document = json.loads(result.stdout)
        expected = reference("oleo_j1_reference.csv")
        self.assertEqual(document["type"], "estimate")
        self.assertTrue(document["usable"])
        for parameter, theta in zip(document["parameters"], expected["theta"], strict=True):
            self.assertAlmostEqual(parameter["value"] / theta, 1.0, delta=1e-6)
        errors = [math.sqrt(expected["cov"][5 * i]) for i in range(4)]
        for parameter, error in zip(document["parameters"], errors, strict=True):
            self.assertAlmostEqual(parameter["standard_error"] / error, 1.0, delta=1e-3)
        self.assertAlmostEqual(document["sum_of_squares"] / expected["ssr"][0], 1.0, delta=1e-4)

    def test_units_of_the_header_row_are_converted_to_the_models(self):
        lines = (DATA / "oleo_j1.csv").read_text().splitlines()
        self.assertEqual(lines[0], "t,y")
        rows = [[float(number) for number in line.split(",")] for line in lines[1:]]
        plain = json.loads(self.estimate(DATA / "oleo_j1.csv", "--json").stdout)
        other = self.write("in.csv", "t [ms],y [in]\n" + "".join(f"{1e3 * t!r},{12 * y!r}\n" for t, y in rows))
        result = self.estimate(other, "--json")
        self.assertEqual(result.returncode, 0, result.stderr)
        for a, b in zip(plain["parameters"], json.loads(result.stdout)["parameters"], strict=True):
            self.assertAlmostEqual(a["value"] / b["value"], 1.0, delta=1e-9)
        for header, sentence in (("t [h],y", '"h" is no unit of time; known are s, ms, us, min'),
                                 ("t,y [g]", '"g" and the model\'s "ft" do not match; known are m, cm')):
            wrong = self.write("wrong.csv", "\n".join([header, *lines[1:]]))
            result = self.estimate(wrong)
            self.assertEqual(result.returncode, 2)
            self.assertIn(f"{wrong}:1: column ", result.stderr)
            self.assertIn(sentence, result.stderr)

    def test_refines_the_grid_to_the_accuracy_that_is_asked_for(self):
        result = self.estimate(DATA / "oleo_j1.csv", "--accuracy", "1e-9", "--json")
        self.assertEqual(result.returncode, 0, result.stderr)
        document = json.loads(result.stdout)
        for parameter, theta in zip(document["parameters"], reference("oleo_j1_reference.csv")["theta"], strict=True):
            self.assertAlmostEqual(parameter["value"] / theta, 1.0, delta=1e-9)
        self.assertTrue(document["grid"]["reached"])
        self.assertLess(document["grid"]["error"], 1e-9)
        self.assertRegex(self.estimate(DATA / "oleo_j1.csv", "--accuracy", "1e-9").stdout,
                         r"on \d+ points a period, which changes no parameter by more than \d")

    def test_the_grid_follows_friction_whose_width_is_stated(self):
        # Turned round at once: Runge and Kutta's steps, each reversal found by halving.
        def force(t, u, v, side):
            return 3 * math.cos(4 * math.pi * t) - 1.6 * v - 80 * u - 0.2 * side

        def step(t, u, v, h, side):
            a1 = force(t, u, v, side)
            v2 = v + h / 2 * a1
            a2 = force(t + h / 2, u + h / 2 * v, v2, side)
            v3 = v + h / 2 * a2
            a3 = force(t + h / 2, u + h / 2 * v2, v3, side)
            v4 = v + h * a3
            a4 = force(t + h, u + h * v3, v4, side)
            return u + h / 6 * (v + 2 * v2 + 2 * v3 + v4), v + h / 6 * (a1 + 2 * a2 + 2 * a3 + a4)

        rows = ["t,excitation,displacement"]
        u, v, side = 0.0, 0.0, 1
        for i in range(64 * 40):
            t = i / 128
            if i >= 64 * 30:
                rows.append(f"{t - 15:.9f},{3 * math.cos(4 * math.pi * t):.9f},{u:.12f}")
            for k in range(8):
                left = 1 / 1024
                now = t + k * left
                u2, v2 = step(now, u, v, left, side)
                if v2 * side < 0:
                    low, high = 0.0, left
                    for _ in range(50):
                        middle = (low + high) / 2
                        low, high = (middle, high) if step(now, u, v, middle, side)[1] * side >= 0 else (low, middle)
                    u, v = step(now, u, v, low, side)
                    self.assertGreater(abs(force(now + low, u, 0.0, 0)), 0.2)  # it does not stick
                    side = -side
                    u2, v2 = step(now + low, u, 0.0, left - low, side)
                u, v = u2, v2
        data = self.write("dry.csv", "\n".join(rows) + "\n")

        def friction(**constants):
            model = self.write("dry.json", json.dumps({"format": "shaker-model/1", "name": "dry", "effects": [
                {"effect": "viscous_damping", "parameters": {"c": {"start": 1.6, "fixed": True}}},
                {"effect": "linear_stiffness", "parameters": {"k": {"start": 80}}},
                {"effect": "coulomb_friction", "parameters": {"f_c": {"start": 0.3}}, "constants": constants}]}))
            result = run("estimate", data, "--model", model, "--frequency", 2, "--json")
            # Without noise, what the grid leaves is more than the scatter explains.
            self.assertEqual(result.returncode, 6, result.stderr)
            document = json.loads(result.stdout)
            return next(p["value"] for p in document["parameters"] if p["name"] == "f_c"), document

        value, document = friction(e=2e-4)
        self.assertAlmostEqual(value / 0.2, 1.0, delta=3e-3)
        self.assertTrue(document["grid"]["reached"])
        self.assertNotIn("grid", friction()[1])

    def test_an_accuracy_of_several_channels_is_refused_not_forgotten(self):
        result = self.estimate(DATA / "oleo_j1.csv", "--accuracy", "1e-9", "--objective", "joint_covariance")
        self.assertEqual(result.returncode, 2)
        self.assertIn("--accuracy", result.stderr)

    def test_prints_a_table(self):
        result = self.estimate(DATA / "oleo_j1.csv")
        self.assertEqual(result.returncode, 0)
        self.assertRegex(result.stdout, r"theta1 +5\.072 ± 0\.039 +4\.99\d \.\. 5\.15\d  1/ft")

    def test_takes_a_measured_excitation_of_any_phase_and_windows_files(self):
        """The record shifted in time, its cosine given as a column with the accelerometer's offset."""
        rows = list(csv.DictReader((DATA / "oleo_j1.csv").open()))
        shift = 0.1234
        lines = ["t,excitation,displacement"]
        for period in range(3):
            for row in rows:
                t = float(row["t"]) + 0.5 * period
                x = 10 * math.cos(4 * math.pi * t) + 0.3
                lines.append(f"{t + shift!r},{x!r},{row['y']}")
        file = self.write("x.csv", "\ufeff" + "\r\n".join(lines) + "\r\n")
        result = run("estimate", file, "--model", self.model, "--frequency", 2, "--json")
        self.assertEqual(result.returncode, 0, result.stderr)
        expected = reference("oleo_j1_reference.csv")["theta"]
        for parameter, theta in zip(json.loads(result.stdout)["parameters"], expected, strict=True):
            self.assertAlmostEqual(parameter["value"] / theta, 1.0, delta=1e-4)

    def test_bad_input_is_2_with_its_place(self):
        good = (DATA / "oleo_j1.csv").read_text().splitlines()
        broken = good[:5] + [good[5].split(",")[0] + ",oops"] + good[6:]
        file = self.write("bad.csv", "\n".join(broken))
        result = self.estimate(file)
        self.assertEqual(result.returncode, 2)
        self.assertIn(f'{file}:6:2: "oops" is not a number (y)', result.stderr)
        file = self.write("back.csv", "\n".join(good[:5] + [good[4]] + good[5:]))
        self.assertIn("time does not increase", self.estimate(file).stderr)
        file = self.write("few.csv", "\n".join(good[:6]))
        self.assertIn("5 points; at least 8", self.estimate(file).stderr)
        self.assertIn("columns t,excitation,displacement or t,y",
                      self.estimate(self.write("cols.csv", "a,b\n1,2\n")).stderr)
        self.assertIn("--frequency", run("estimate", DATA / "oleo_j1.csv", "--model", self.model).stderr)
        self.assertIn("--model", run("estimate", DATA / "oleo_j1.csv", "--frequency", 2).stderr)
        self.assertIn("--amplitude", run("estimate", DATA / "oleo_j1.csv", "--frequency", 2,
                                         "--model", self.model).stderr)
        self.assertIn("cannot be read", self.estimate(self.path / "missing.csv").stderr)

    def test_several_starts_cure_a_start_that_ends_where_nothing_moves(self):
        bad = json.loads(self.model.read_text())
        for effect, name, value in ((0, "theta1", 3000), (1, "theta2", 60), (1, "theta3", 0.2)):
            bad["effects"][effect]["parameters"][name]["start"] = value
        words = ("estimate", DATA / "oleo_j1.csv", "--model", self.write("bad.json", json.dumps(bad)),
                 "--frequency", 2, "--amplitude", 10)
        self.assertEqual(run(*words).returncode, 5)
        result = run(*words, "--starts", 8, "--json")
        self.assertEqual(result.returncode, 0, result.stderr)
        document = json.loads(result.stdout)
        best = reference("oleo_j1_reference.csv")["theta"]
        for parameter, value in zip(document["parameters"], best):
            self.assertAlmostEqual(parameter["value"] / value, 1.0, delta=1e-4)
        self.assertEqual(document["minima"][0]["status"], "converged")
        self.assertIn("Where the starts ended", run(*words, "--starts", 8).stdout)

    def test_a_constant_record_gives_no_usable_estimate(self):
        lines = ["t,y"] + [f"{i / 80},0.53" for i in range(40)]
        result = self.estimate(self.write("flat.csv", "\n".join(lines)))
        self.assertIn(result.returncode, (2, 5))
        self.assertTrue(result.stderr)

    def test_a_start_without_a_periodic_solution_is_said(self):
        model = json.loads(json.dumps(OLEO_FEET))
        model["effects"][1]["parameters"]["theta3"] = {"start": 1e3}
        self.model.write_text(json.dumps(model))
        result = self.estimate(DATA / "oleo_j1.csv")
        self.assertEqual(result.returncode, 5, result.stdout + result.stderr)
        self.assertTrue(result.stderr)

    def test_an_excitation_past_the_gas_column_is_said_with_how_far_it_got(self):
        """An excitation ten times too large, as in wrong units."""
        rows = "".join(f"{i / 200},{80 * math.cos(math.pi * i / 100)},{0.1 * math.cos(math.pi * i / 100 - 0.5)}\n"
                       for i in range(400))
        record = self.write("hard.csv", "t,excitation,displacement\n" + rows)
        model = self.write("short.json", json.dumps({"name": "short", "gravity": 9.80665, "effects": [
            {"effect": "orifice_damping", "parameters": {"theta1": {"start": 16}}},
            {"effect": "gas_spring", "parameters": {"theta2": {"start": 1.5}, "theta3": {"start": 9.9},
                                                    "theta4": {"start": 1}}},
            {"effect": "gravity"}]}))
        result = run("estimate", record, "--model", model, "--frequency", 1)
        self.assertEqual(result.returncode, 5, result.stdout + result.stderr)
        self.assertRegex(result.stderr, r"run 1 \(1 Hz\): no periodic solution .* got to (1\d|\d)(\.\d)? % of it")
        self.assertIn("give starting values nearer to the damper's, or check the excitation's size and unit",
                      result.stderr)

    def test_what_is_determined_keeps_its_row_beside_what_is_not(self):
        """At one frequency a mass and a spring look alike; the damper is known as without the mass."""
        omega, noise = 2 * math.pi, [((7919 * i) % 401 - 200) * 1e-6 for i in range(400)]
        response = 2.0 / complex(60 - omega**2, 3 * omega)
        record = self.write("two.csv", "t,excitation,displacement\n" + "".join(
            f"{i / 200},{2 * math.cos(omega * i / 200)},"
            f"{abs(response) * math.cos(omega * i / 200 + math.atan2(response.imag, response.real)) + noise[i]}\n"
            for i in range(400)))
        effects = [{"effect": "viscous_damping"}, {"effect": "linear_stiffness"}]
        rows = []
        for more in ([], [{"effect": "added_mass"}]):
            model = self.write("m.json", json.dumps({"name": "m", "effects": effects + more}))
            result = run("estimate", record, "--model", model, "--frequency", 1, "--json")
            document = json.loads(result.stdout)
            self.assertEqual(document["usable"], not more)
            rows.append({parameter["name"]: parameter for parameter in document["parameters"]})
        alone, alike = rows
        for name in ("k", "m_a"):
            self.assertFalse(alike[name]["determined"])
            self.assertNotIn("standard_error", alike[name])
        self.assertTrue(alike["c"]["determined"])
        for figure in ("value", "standard_error"):
            self.assertAlmostEqual(alike["c"][figure] / alone["c"][figure], 1.0, delta=1e-6, msg=figure)
        for end, expected in zip(alike["c"]["interval"], alone["c"]["interval"], strict=True):
            self.assertAlmostEqual(end / expected, 1.0, delta=1e-8)
        # In closed form: c's slope of the response a / D is |a| omega / |D|^2.
        error = alone["c"]["standard_error"]
        s = document["noise_standard_deviation"]
        size = abs(complex(60 - omega**2, 3 * omega))**2
        self.assertAlmostEqual(error / (s * math.sqrt(2 / 400) * size / (2 * omega)), 1.0, delta=1e-3)
        table = run("estimate", record, "--model", model, "--frequency", 1).stdout
        row = next(line for line in table.splitlines() if line.startswith("c "))
        self.assertIn("±", row)
        self.assertNotIn("not determined", row)


class Database(Scratch):
    """Two noise-free runs of an independent solver, with a known scatter put on their cycles."""

    def setUp(self):
        super().setUp()
        runs = {}
        for row in csv.DictReader((DATA / "oleo_j2.csv").open()):
            runs.setdefault(row["run"], []).append(row)
        self.rows = list(runs.values())
        table = "".join(",".join([run[0]["f"], run[0]["a"]] + [row["y"] for row in run]) + "\n"
                        for run in self.rows)
        made = subprocess.run([MAKE_CAMPAIGN, self.path, self.write("table.csv", table), self.model],
                              capture_output=True, text=True, check=True)
        self.database = pathlib.Path(made.stdout.strip())

    def test_estimates_from_all_runs_jointly(self):
        result = run("estimate", self.database, "--json")
        # The noise of the data set is the same in every cycle, which the scatter does not know.
        self.assertEqual(result.returncode, 6, result.stderr)
        document = json.loads(result.stdout)
        self.assertEqual(document["campaign"], "known")
        self.assertEqual(document["runs_used"], len(self.rows))
        self.assertEqual(document["cycles_used"], 3 * len(self.rows))
        for parameter, theta in zip(document["parameters"], reference("oleo_j2_reference.csv")["theta"],
                                    strict=True):
            self.assertAlmostEqual(parameter["value"] / theta, 1.0, delta=1e-5)

    def test_another_model_may_be_tried(self):
        other = json.loads(json.dumps(OLEO_FEET))
        other["effects"][1]["parameters"]["theta4"] = {"start": 1.0, "fixed": True}
        result = run("estimate", self.database, "--model", self.write("o.json", json.dumps(other)), "--json")
        document = json.loads(result.stdout)
        self.assertTrue(document["parameters"][3]["fixed"])
        # It misses the cycles by more than their scatter: the intervals count that only.
        self.assertGreater(document["gap"], 3 * document["noise_floor"])
        self.assertEqual((result.returncode, document["usable"], document["intervals_hold"]), (6, True, False))
        table = run("estimate", self.database, "--model", self.path / "o.json").stdout
        self.assertIn("the values stand, the INTERVALS DO NOT", table)
        self.assertNotRegex(table, r"\busable\b")
        self.assertEqual(run("estimate", self.database, "--frequency", 2).returncode, 2)

    def test_exports_cycles_that_can_be_estimated_from(self):
        out = self.path / "out"
        result = run("export", self.database, "--directory", out, "--json")
        self.assertEqual(result.returncode, 0, result.stderr)
        files = json.loads(result.stdout)["files"]
        self.assertEqual(len(files), len(self.rows))
        self.assertEqual(files[0]["cycles"], 3)
        with open(files[0]["file"]) as file:
            rows = list(csv.DictReader(file))
        points = len(self.rows[0])
        self.assertEqual(len(rows), 3 * points)
        self.assertTrue(all(row["accepted"] == "1" for row in rows))
        self.assertAlmostEqual(float(rows[points]["displacement"]),
                               float(self.rows[0][0]["y"]) - 1e-5, delta=1e-15)
        frequency = float(self.rows[0][0]["f"])
        self.assertAlmostEqual(float(rows[points]["t"]) - float(rows[0]["t"]), 1 / frequency, delta=1e-12)
        every = run("export", self.database, "--directory", out, "--all")
        self.assertEqual(every.returncode, 0)
        with open(files[0]["file"]) as file:
            self.assertEqual(len(list(file)), 1 + 4 * points)
        self.assertEqual([p.name for p in out.glob("*.part")], [])

    def test_exports_raw_samples(self):
        result = run("export", self.database, "--directory", self.path, "--samples")
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertEqual((self.path / "known_r01_samples.csv").read_text(),
                         "t,channel,value,quality,unit\n0.000000000,displacement,0.125,good,m\n"
                         "0.001000000,excitation,-2.5,suspect,m/s^2\n"
                         "0.002000000,gas_pressure,1000000,good,Pa\n")

    def test_what_is_not_a_campaign_is_2(self):
        for file in (self.path / "missing.db", self.write("text.db", "hello")):
            with self.subTest(file=file.name):
                result = run("export", file)
                self.assertEqual(result.returncode, 2)
                self.assertIn(file.name, result.stderr)
                self.assertEqual(run("estimate", file).returncode, 2)

    def test_a_folder_that_cannot_be_written_is_said(self):
        result = run("export", self.database, "--directory", "/proc/nowhere")
        self.assertEqual(result.returncode, 2)
        self.assertIn("cannot be written", result.stderr)


class Compare(Scratch):
    def compare(self, *words):
        result = run("compare", *words, "--json")
        return result.returncode, json.loads(result.stdout)

    def test_methods_agree_on_a_record(self):
        code, document = self.compare(DATA / "oleo_j1.csv", "--model", self.model, "--frequency", 2,
                                      "--amplitude", 10)
        self.assertEqual(code, 0)
        self.assertEqual(document["parameters"], ["theta1", "theta2", "theta3", "theta4"])
        least = reference("oleo_j1_reference.csv")["ssr"][0]
        self.assertGreaterEqual(len(document["methods"]), 12)
        for row in document["methods"]:
            self.assertAlmostEqual(row["sum_of_squares"] / least, 1.0, delta=1e-3, msg=row["method"])
            self.assertGreaterEqual(row["periodic_solutions"], row["iterations"], row["method"])

    def test_a_bad_start_of_the_papers_data_tells_methods_apart(self):
        code, document = self.compare("--figure", 12, "--start", "0.1,20,0.5,1", "--method",
                                      "automatic", "--method", "gauss_newton")
        self.assertEqual(code, 0)
        automatic, pure = document["methods"]
        self.assertEqual(automatic["status"], "converged")
        for value, printed in zip(automatic["theta"], (4.6911, 4.9864, 1.6184, 1.0029)):
            self.assertAlmostEqual(value, printed, delta=2e-4)
        self.assertNotEqual(pure["status"], "converged")

    def test_wrong_use_is_said(self):
        self.assertIn("choose from", run("compare", "--figure", 12, "--method", "magic").stderr)
        self.assertIn("free parameters", run("compare", "--figure", 12, "--start", "1,2").stderr)
        self.assertIn("outside", run("compare", "--figure", 12, "--start", "1,2,3,-4").stderr)
        self.assertIn("--figure", run("compare").stderr)
        self.assertEqual(run("compare", "--figure", 9).returncode, 2)


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], "-v"])
