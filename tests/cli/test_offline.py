"""shakerctl without a daemon: the real program, its output and its exit status."""
import csv
import json
import math
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
EXAMPLES = ROOT / "config" / "examples"
DATA = ROOT / "tests" / "data"
SHAKERCTL = os.environ["SHAKERCTL"]
MAKE_CAMPAIGN = os.environ["MAKE_CAMPAIGN"]
OLEO_FEET = {"name": "oleo", "gravity": 32.2, "length_unit": "ft", "effects": [
    {"effect": "orifice_damping", "parameters": {"theta1": {"start": 5.334}}},
    {"effect": "gas_spring", "parameters": {"theta2": {"start": 5.25}, "theta3": {"start": 1.701},
                                            "theta4": {"start": 1.05}}},
    {"effect": "gravity"}]}


def run(*words, **more):
    return subprocess.run([SHAKERCTL, *map(str, words)], capture_output=True, text=True, timeout=120,
                          **more)


def reference(name):
    rows = {}
    for line in (DATA / name).read_text().splitlines():
        key, *numbers = line.split(",")
        rows[key] = [float(number) for number in numbers]
    return rows


class Scratch(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.path = pathlib.Path(self.folder.name)
        self.model = self.write("oleo.json", json.dumps(OLEO_FEET))

    def write(self, name, text):
        path = self.path / name
        path.write_text(text, newline="")
        return path


class Usage(Scratch):
    def test_help_names_every_command_and_its_options(self):
        result = run("--help")
        self.assertEqual(result.returncode, 0)
        for command in ("status", "watch", "run", "stop", "estop", "ack", "estimate", "compare", "reproduce",
                        "export", "check", "monte-carlo", "plan"):
            self.assertIn(f"  {command} ", result.stdout)
            own = run(command, "--help")
            self.assertEqual(own.returncode, 0)
            self.assertIn("--json", own.stdout)

    def test_version(self):
        result = run("--version")
        self.assertEqual(result.returncode, 0)
        self.assertRegex(result.stdout, r"^shakerctl \d+\.\d+\.\d+\n$")

    def test_wrong_usage_is_2(self):
        for words in ((), ("nonsense",), ("run",), ("check",), ("estimate", "x.csv", "--frequency", "fast"),
                      ("reproduce", "--figure", "11", "--bias"), ("watch", "--seconds", "-1")):
            with self.subTest(words=words):
                result = run(*words)
                self.assertEqual(result.returncode, 2)
                self.assertTrue(result.stderr)

    def test_without_a_daemon_is_3_and_says_the_remedy(self):
        socket = self.path / "none.sock"
        for words in (("status",), ("watch",), ("stop",), ("estop",), ("ack",),
                      ("run", EXAMPLES / "campaign-demo.json")):
            with self.subTest(words=words):
                result = run(*words, "--socket", socket)
                self.assertEqual(result.returncode, 3)
                self.assertIn(f"{socket}: there is no daemon", result.stderr)
                self.assertIn("systemctl start shakerd", result.stderr)
                self.assertEqual(result.stdout, "")

    def test_the_socket_comes_from_the_environment(self):
        result = run("status", "--json", env={**os.environ, "SHAKERD_SOCKET": str(self.path / "env.sock")})
        self.assertEqual(result.returncode, 3)
        error = json.loads(result.stdout)
        self.assertIn("env.sock", error["error"])
        self.assertEqual(error["exit_code"], 3)


class Check(Scratch):
    def test_every_example_is_good(self):
        for path in sorted(EXAMPLES.glob("*.json")):
            with self.subTest(path.name):
                result = run("check", path)
                self.assertEqual(result.returncode, 0, result.stderr)
                self.assertIn(f"a good {path.name.split('-')[0]} file", result.stdout)

    def test_says_which_it_is_and_what_is_wrong(self):
        bad = self.write("bad.json", '{"runs": [{"frequency_hz": -2, "amplitude": 3}],\n"nmae": 1}')
        result = run("check", bad)
        self.assertEqual(result.returncode, 2)
        self.assertIn(f"{bad}:1: key \"name\" is missing", result.stderr)
        self.assertIn("/runs/0/frequency_hz: -2 is out of range", result.stderr)
        self.assertIn(f'{bad}:2: /nmae: unknown key; did you mean "name"?', result.stderr)
        self.assertIn("not a good campaign file", result.stderr)
        report = json.loads(run("check", bad, "--json").stdout)
        self.assertFalse(report["good"])
        self.assertEqual(report["kind"], "campaign")
        self.assertGreaterEqual(len(report["errors"]), 3)

    def test_an_effect_in_a_campaigns_own_model_has_its_place(self):
        bad = self.write("c.json", '{"name": "c", "runs": [{"frequency_hz": 2, "amplitude": 3}],\n'
                                   '"model": {"name": "m", "effects": [{"effect": "gravity"},\n{"effect": "magic"}]}}')
        self.assertIn(f"{bad}:3: /model/effects/1", run("check", bad).stderr)

    def test_a_start_without_a_gas_column_is_said(self):
        model = '{"name": "m", "effects": [{"effect": "gas_spring", "parameters": {"theta3": {"start": %g}}}]}'
        self.assertIn("gas column is only 0.0025 m long", run("check", self.write("m.json", model % 400)).stdout)
        self.assertNotIn("gas column", run("check", self.write("m.json", model % 5.3)).stdout)
        campaign = self.write("c.json", '{"name": "c", "runs": [{"frequency_hz": 2, "amplitude": 3}], "model": %s}' % (model % 20))
        self.assertNotIn("gas column", run("check", campaign).stdout)
        held = run("check", campaign, "--rig", EXAMPLES / "rig-simulated.json").stdout
        self.assertEqual(held.count("gas column is only 0.05 m long"), 1, held)

    def test_an_unknown_command_is_named_with_the_nearest_first(self):
        result = run("estimat", "x.csv")
        self.assertEqual(result.returncode, 2)
        self.assertRegex(result.stderr, r'there is no command "estimat"; there are estimate, ')
        self.assertIn("watch", result.stderr)

    def test_knows_the_catalogue(self):
        bad = self.write("m.json", '{"name": "m", "effects": [{"effect": "magic"}]}')
        result = run("check", bad)
        self.assertEqual(result.returncode, 2)
        self.assertIn("magic", result.stderr)
        self.assertIn("orifice_damping", result.stderr)

    def test_looks_into_the_dbc(self):
        text = (EXAMPLES / "rig-can.json").read_text()
        for name in ("shaker.dbc", "stroke-transducer.dbc"):
            self.write(name, (EXAMPLES / name).read_text())
        self.write("rig.json", text.replace('"position"', '"positon"'))
        result = run("check", self.path / "rig.json")
        self.assertEqual(result.returncode, 2)
        self.assertIn('message STROKE has no signal "positon"; it has position, velocity, status',
                      result.stderr)
        (self.path / "shaker.dbc").unlink()
        self.assertIn("shaker.dbc: cannot be read", run("check", self.path / "rig.json").stderr)

    def test_holds_a_campaign_against_a_rig(self):
        campaign = self.write("c.json", json.dumps(
            {"name": "c", "model": OLEO_FEET, "runs": [{"frequency_hz": 50, "amplitude": 16}]}))
        self.assertEqual(run("check", campaign).returncode, 0)
        result = run("check", campaign, "--rig", EXAMPLES / "rig-simulated.json")
        self.assertEqual(result.returncode, 2)
        self.assertIn("run r01: 50 Hz is outside of the rig's 0.2 .. 10 Hz", result.stderr)
        self.assertIn("run r01: 16 m/s^2 is above the rig's 15 m/s^2", result.stderr)

    def test_a_file_that_is_none_of_them(self):
        result = run("check", self.write("x.json", "{}"))
        self.assertEqual(result.returncode, 2)
        self.assertIn("neither a rig", result.stderr)
        self.assertEqual(run("check", self.path / "missing.json").returncode, 2)


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
        for effect, name, value in ((0, "theta1", 0.1), (1, "theta2", 60), (1, "theta3", 0.2)):
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
        self.assertEqual(result.returncode, 0, result.stderr)
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
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertTrue(json.loads(result.stdout)["parameters"][3]["fixed"])
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


class Response(Scratch):
    def setUp(self):
        super().setUp()
        self.duffing = self.write("duffing.json", json.dumps({
            "format": "shaker-model/1", "name": "duffing", "effects": [
                {"effect": "viscous_damping", "parameters": {"c": {"start": 0.05}}},
                {"effect": "linear_stiffness", "parameters": {"k": {"start": 1.0}}},
                {"effect": "cubic_stiffness", "parameters": {"k3": {"start": 0.1}}}]}))

    def test_passes_folds_and_draws_unstable_parts_dashed(self):
        words = ("response", self.duffing, "--amplitude", 0.18, "--from", 0.08, "--to", 0.25)
        result = run(*words, "--json", "--svg", self.path / "curve.svg")
        self.assertEqual(result.returncode, 0, result.stderr)
        curve = json.loads(result.stdout)
        self.assertTrue(curve["complete"])
        self.assertEqual([each["kind"] for each in curve["special"]], ["fold", "fold"])
        self.assertFalse(all(point["stable"] for point in curve["points"]))
        picture = (self.path / "curve.svg").read_text()
        for word in ("<svg", "unstable", "fold"):
            self.assertIn(word, picture)
        table = run(*words).stdout
        self.assertIn("unstable", table)
        self.assertIn("fold", table)

    def test_over_the_amplitude(self):
        result = run("response", self.duffing, "--at", 0.1, "--amplitudes", "0.05,0.3", "--json")
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertAlmostEqual(json.loads(result.stdout)["points"][-1]["amplitude"], 0.3)

    def test_wrong_usage_is_2_and_no_solution_is_5(self):
        self.assertEqual(run("response", self.duffing, "--amplitude", 1).returncode, 2)
        self.assertIn("--amplitudes", run("response", self.duffing, "--amplitude", 1).stderr)
        spec = json.loads(self.duffing.read_text())
        spec["gravity"] = 0.3
        spec["effects"].append({"effect": "gravity"})
        spec["effects"][0]["parameters"]["c"]["start"] = 0.2
        spec["effects"][2]["parameters"]["k3"]["start"] = -1
        result = run("response", self.write("soft.json", json.dumps(spec)), "--amplitude", 0.5,
                     "--from", 0.032, "--to", 0.05)
        self.assertEqual(result.returncode, 5, result.stdout)
        self.assertIn("turn back", result.stderr)


class Reproduce(unittest.TestCase):
    def test_agrees_with_the_print(self):
        printed = json.loads((DATA / "verbeek1991.json").read_text())
        for figure in (6, 7, 9, 10, 11, 12, 13, 14):
            with self.subTest(figure=figure):
                result = run("reproduce", "--figure", figure, "--json")
                self.assertEqual(result.returncode, 0, result.stderr)
                answer = json.loads(result.stdout)
                self.assertEqual(answer["figure"], figure)
                self.assertIsInstance(answer["settings"], dict)
                worst = max(abs(a - b) for one, other in zip(answer["printed"], answer["iterates"])
                            for a, b in zip(one, other, strict=True))
                self.assertAlmostEqual(worst, answer["max_deviation"], delta=1e-12)
                self.assertLess(worst, 2e-3 if figure == 9 else 1e-4)
                self.assertIn(str(answer["printed"][-1][0]), json.dumps(printed))

    def test_prints_tables_people_can_read(self):
        result = run("reproduce")
        self.assertEqual(result.returncode, 0)
        for figure in (5, 6, 7, 9, 10, 11, 12, 13, 14):
            self.assertIn(f"Figure {figure}:", result.stdout)
        self.assertEqual(result.stdout.count(": agrees"), 8)

    def test_figure_5_is_said_not_to_be_reproducible(self):
        result = run("reproduce", "--figure", 5, "--json")
        self.assertEqual(result.returncode, 1)
        answer = json.loads(result.stdout)
        self.assertIn("cannot be reproduced", answer["remark"])
        self.assertFalse(answer["reproducible"])

    def test_other_figures_are_refused_and_the_bias_is_shown(self):
        self.assertEqual(run("reproduce", "--figure", 8).returncode, 2)
        rows = json.loads(run("reproduce", "--bias", "--json").stdout)["rows"]
        coarse = next(row for row in rows if row["points"] == 40 and row["scheme"] == "order2")
        self.assertGreater(max(map(abs, coarse["theta_error_percent"])), 1.0)

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
