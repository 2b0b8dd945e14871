"""shakerctl without a daemon: usage, checks of files, responses and the figures."""
import contextlib
import hashlib
import json
import os
import pwd
import sqlite3
import subprocess
import sys
import threading
import unittest

from support import DATA, EXAMPLES, MAKE_CAMPAIGN, OLEO_FEET, Scratch, run


class Usage(Scratch):
    def test_help_names_every_command_and_its_options(self):
        result = run("--help")
        self.assertEqual(result.returncode, 0)
        for command in ("status", "watch", "run", "stop", "estop", "ack", "estimate", "compare", "reproduce",
                        "export", "check", "campaigns", "show", "monte-carlo", "plan"):
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


class Folders(Scratch):
    CHANNELS = ("--channels", "displacement,force", "--objective", "maximum_likelihood")
    COMMANDS = (("estimate",), ("estimate", *CHANNELS), ("compare",), ("export",),
                ("drop", "--sink-speed", "3", "--campaign"))

    def refused(self, *words):
        result = run(*words)
        self.assertEqual(result.returncode, 2, result.stdout)
        return result.stderr

    def test_a_folder_in_place_of_a_database_is_told_with_what_to_give(self):
        for command in self.COMMANDS:
            with self.subTest(command=command):
                (self.path / "empty").mkdir(exist_ok=True)
                self.assertIn("empty: is a folder without a campaign; give a campaign database (.db)",
                              self.refused(*command, self.path / "empty"))
                for day in ("01", "02"):
                    self.write(f"demo_202603{day}T120000Z.db", "")
                self.assertIn(f"the newest is {self.path}/demo_20260302T120000Z.db",
                              self.refused(*command, self.path))


class Campaigns(Scratch):
    def make(self, folder):
        folder.mkdir()
        made = subprocess.run([MAKE_CAMPAIGN, folder, self.write("table.csv", "2,3" + 16 * ",0.1" + "\n"),
                               EXAMPLES / "model-oleo.json"], check=True, capture_output=True, text=True)
        return made.stdout.strip()

    def test_are_listed_with_the_newest_last(self):
        file = self.make(self.path / "data")
        self.write("data/broken.db", "no database")
        result = run("campaigns", self.path / "data")
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertRegex(result.stdout.splitlines()[-1],
                         r"^2026-03-01 12:00:00 UTC  known +none +oleo +1  success +known_20260301T120000Z.db$")
        self.assertIn("broken.db: is not a campaign database", result.stderr)
        listed = json.loads(run("campaigns", self.path / "data", "--json").stdout)["campaigns"]
        self.assertEqual([each.get("campaign") for each in listed], [None, "known"])
        self.assertEqual(listed[1]["file"], file)

    def test_an_empty_directory_has_none_and_a_missing_one_is_2(self):
        (self.path / "empty").mkdir()
        self.assertIn("empty holds no campaign yet.", run("campaigns", self.path / "empty").stdout)
        result = run("campaigns", self.path / "missing")
        self.assertEqual(result.returncode, 2)
        self.assertIn("missing: No such file or directory", result.stderr)

    def test_show_counts_the_cycles(self):
        file = self.make(self.path / "data")
        result = run("show", file)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertIn("campaign known on rig none, model oleo\n"
                      "measured 2026-03-01 12:00:00 UTC to 2026-03-01 12:01:00 UTC, success\n", result.stdout)
        self.assertRegex(result.stdout, r"r01 +2 +3 +3 +1 +3\n")
        shown = json.loads(run("show", file, "--json").stdout)
        self.assertEqual(shown["runs"], [{"name": "r01", "frequency_hz": 2.0, "amplitude": 3.0, "cycles_wanted": 3,
                                          "cycles_accepted": 3, "cycles_left_out": 1}])
        self.assertIsNone(shown["estimate"])
        self.assertEqual([(each["of"], each["hash_matches"]) for each in shown["facts"]],
                         [("campaign", True), ("model", True)])
        self.assertEqual(run("show", self.path / "none.db").returncode, 2)
        self.assertIn(f"the newest is {file}", run("show", self.path / "data").stderr)

    def test_a_note_is_shown_with_its_user_and_a_changed_one_too(self):
        file = self.make(self.path / "data")
        result = run("note", file, "the oil was cold\x1b[31m")
        self.assertEqual(result.returncode, 0, result.stderr)
        user = pwd.getpwuid(os.getuid()).pw_name
        self.assertRegex(run("show", file).stdout,
                         rf"note of \d{{4}}-\d\d-\d\d \d\d:\d\d:\d\d UTC by {user}: the oil was cold \[31m\n")
        note = json.loads(run("show", file, "--json").stdout)["facts"][0]
        self.assertEqual(note["sha256"], hashlib.sha256(note["value"].encode()).hexdigest())
        with contextlib.closing(sqlite3.connect(file)) as database, database:
            database.execute("UPDATE fact SET value = 'the oil was warm'")
        self.assertIn("the oil was warm (ITS HASH DOES NOT MATCH)", run("show", file).stdout)

    def test_a_note_that_cannot_be_kept_is_2(self):
        file = self.make(self.path / "data")
        self.assertIn("1 to 10000 bytes; this one has 0", run("note", file, "").stderr)
        self.assertIn("there is no such file", run("note", self.path / "none.db", "x").stderr)
        with contextlib.closing(sqlite3.connect(file)) as database, database:
            database.execute("UPDATE campaign SET status = 'running'")
        result = run("note", file, "x")
        self.assertEqual(result.returncode, 2)
        self.assertIn("still being recorded", result.stderr)

    def test_a_note_waits_until_the_recorder_has_closed_the_file(self):
        file = self.make(self.path / "data")

        def say(status):
            with contextlib.closing(sqlite3.connect(file)) as database, database:
                database.execute("UPDATE campaign SET status = ?", (status,))

        say("running")
        closing = threading.Timer(1.0, say, ("success",))
        closing.start()
        self.assertEqual(run("note", file, "x").returncode, 0)
        closing.join()


class Check(Scratch):
    def test_every_example_is_good(self):
        for path in sorted(EXAMPLES.glob("*.json")):
            with self.subTest(path.name):
                result = run("check", path)
                self.assertEqual(result.returncode, 0, result.stderr)
                self.assertIn(f"a good {path.name.split('-')[0]} file", result.stdout)

    def test_says_of_a_sensor_when_its_calibration_is_due(self):
        rig = EXAMPLES / "rig-simulated.json"
        good = run("check", rig)
        self.assertIn("displacement sensor L-0815: calibrated 2026-01-12, due 2099-01-12, uncertainty 2e-05 m",
                      good.stdout)
        self.assertNotIn("overdue", good.stdout + good.stderr)
        self.write("model-oleo.json", (EXAMPLES / "model-oleo.json").read_text())
        late = run("check", self.write("rig.json", rig.read_text().replace("2099-01-12", "2026-01-13")))
        self.assertEqual(late.returncode, 0, late.stderr)
        self.assertIn("displacement sensor L-0815: calibration is overdue", late.stdout + late.stderr)

    def test_says_which_it_is_and_what_is_wrong(self):
        bad = self.write("bad.json", '{"runs": [{"frequency_hz": -2, "amplitude": 3}],\n"nmae": 1}')
        result = run("check", bad)
        self.assertEqual(result.returncode, 2)
        self.assertIn(f"{bad}:1: key \"name\" is missing", result.stderr)
        self.assertIn("/runs/0/frequency_hz: -2 is out of range", result.stderr)
        self.assertIn(f'{bad}:2: /nmae: unknown key; did you mean "name"?', result.stderr)
        self.assertIn("not a good campaign file", result.stderr)
        # The campaign is good and the rig is not.
        rig = self.write("rig.json", (EXAMPLES / "rig-simulated.json").read_text().replace("simulated", "real"))
        for good in (EXAMPLES / "campaign-three-runs.json", EXAMPLES / "shaker.dbc"):
            result = run("check", good, "--rig", rig)
            self.assertEqual(result.returncode, 2)
            self.assertIn(f"{rig}: not a good rig file; {good} was not checked against it", result.stderr)
        report = json.loads(run("check", bad, "--json").stdout)
        self.assertFalse(report["good"])
        self.assertEqual(report["kind"], "campaign")
        self.assertGreaterEqual(len(report["errors"]), 3)

    def test_check_says_what_a_dbc_holds_and_what_a_rig_uses_of_it(self):
        plain = run("check", EXAMPLES / "shaker.dbc")
        self.assertEqual(plain.returncode, 0, plain.stderr)
        self.assertIn("frequency: 16 bits from 0, Hz, 0 to 65.535\n", plain.stdout)
        used = run("check", EXAMPLES / "shaker.dbc", "--rig", EXAMPLES / "rig-can.json").stdout
        self.assertIn("amplitude: 16 bits from 16, m/s^2, 0 to 65.535  <- used by the rig", used)
        text = (EXAMPLES / "shaker.dbc").read_text(encoding="latin-1").replace('"m/s^2" SHAKER', '"barn" SHAKER')
        odd = run("check", self.write("odd.dbc", text))
        self.assertIn('amplitude: "barn" is no unit', odd.stdout)
        broken = run("check", self.write("broken.dbc", text.replace("0|16@1+", "0|16@7+", 1)))
        self.assertEqual(broken.returncode, 2)
        self.assertRegex(broken.stderr, r"broken.dbc:\d+: ")

    def test_a_file_may_name_its_schema(self):
        example = EXAMPLES / "campaign-demo.json"
        self.assertIn('"$schema": "../schema/campaign.schema.json"', example.read_text())
        self.assertTrue((example.parent.parent / "schema" / "campaign.schema.json").is_file())
        self.assertEqual(run("check", example).returncode, 0)

    def test_a_recorded_campaign_is_read_with_its_runs(self):
        self.write("r1.csv", "t,displacement,force\n0,1,2\n50,2,3\n")
        text = ('{"format": "shaker-campaign/1", "units": {"time": "ms", "displacement": "mm"},\n'
                '"runs": [{"name": "r1", "kind": "imposed_motion", "frequency_hz": 2, "amplitude": 30}]}')
        good = run("check", self.write("campaign.json", text))
        self.assertEqual(good.returncode, 0, good.stderr)
        self.assertIn("r1: 2 Hz, 0.03 m, 2 samples in 0.05 s", good.stdout)
        self.assertIn("a good campaign file", good.stdout)
        bad = run("check", self.write("bad.json", text.replace("frequency_hz", "frequency")))
        self.assertEqual(bad.returncode, 2)
        self.assertIn('bad.json:2: /runs/0/frequency: unknown key; did you mean "frequency_hz"?', bad.stderr)

    def test_a_recorded_transient_is_no_run_of_0_hz(self):
        self.write("drop.csv", "t,displacement\n0,0.1\n0.05,0.2\n")
        good = run("check", self.write("campaign.json", '{"format": "shaker-campaign/1",\n'
                                       '"runs": [{"name": "drop", "kind": "transient"}]}'))
        self.assertEqual(good.returncode, 0, good.stderr)
        self.assertIn("drop: transient, 2 samples in 0.05 s", good.stdout)

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

    def test_says_which_limits_act(self):
        rig = {"name": "r", "exciter": {"device": {"kind": "simulated"}}, "sensors": [{"kind": "simulated"}]}
        every = ("stroke", "stroke_rate", "excitation", "stale", "command_error", "response_change")
        whole = run("check", self.write("whole.json", json.dumps(rig))).stdout
        self.assertIn(f"limits that end the motion: {', '.join(every)}\n", whole)
        self.assertNotIn("none", whole)
        actions = {f"{key}_action": "none" for key in every} | {"stale_action": "ramp_down",
                                                                "stroke_rate_action": "indicate"}
        some = run("check", self.write("some.json", json.dumps(rig | {"limits": actions}))).stdout
        self.assertIn("limits that end the motion: stale\n", some)
        self.assertIn("limits that are only told or hold: stroke_rate\n", some)
        self.assertIn('stroke_action is "none": the daemon does not watch this limit', some)
        actions["stale_action"] = "none"
        refused = run("check", self.write("bare.json", json.dumps(rig | {"limits": actions})))
        self.assertEqual(refused.returncode, 2)
        self.assertIn("/limits: no detector ends the motion", refused.stderr)
        meant = run("check", self.write("meant.json", json.dumps(rig | {"limits": actions, "unprotected": True})))
        self.assertEqual(meant.returncode, 0, meant.stderr)
        self.assertIn("unprotected: no limit of this rig ends the motion", meant.stdout)
        self.assertNotIn("limits that end", meant.stdout)

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


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], "-v"])
