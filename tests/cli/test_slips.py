"""What an operator types wrongly: one sentence names the place and the remedy, and nothing is lost."""
import json
import os
import pathlib
import subprocess
import unittest

from support import EXAMPLES, MAKE_CAMPAIGN, Scratch, run


class Slips(Scratch):
    def setUp(self):
        super().setUp()
        table = self.write("table.csv", "2,3" + 16 * ",0.1" + "\n")
        made = subprocess.run([MAKE_CAMPAIGN, self.path, table, self.model], check=True,
                              capture_output=True, text=True)
        self.database = pathlib.Path(made.stdout.strip())

    def refused(self, *words, status=2):
        result = run(*words)
        self.assertEqual(result.returncode, status, result.stdout + result.stderr)
        self.assertTrue(result.stderr.startswith("shakerctl: "), result.stderr)
        self.assertNotIn("Run with --help", result.stderr)
        self.assertNotIn("HDF5-DIAG", result.stderr)
        self.assertLess(len(result.stderr), 600)
        return result.stderr

    def test_a_command_line_is_told_what_it_lacks(self):
        db = self.database
        for words, sentence in (
                ((), "give a command; `shakerctl --help` explains"),
                (("note", db), "note: text is missing; `shakerctl note --help` explains"),
                (("check",), "check: file is missing"),
                (("plan",), "plan: model is missing"),
                (("export", db, "--out", "x"), "export: there is no --out; there are --"),
                (("export", db, "one", "more"), 'export: "one" is one word too many'),
                (("estimate", db, "--modle", "m"), "estimate: there is no --modle; there are --model, "),
                (("export", db, "--format", "xlsx"), "export: --format: xlsx not in {csv,mat,uff}"),
                (("drop", db, "--sink-speed", "3ft/s"), 'drop: --sink-speed: "3ft/s" is not a number'),
                (("drop", db, "--sink-speed", 3, "--mass", "-4"), "drop: --mass: -4 is not a positive number"),
                (("watch", "--seconds", "-1"), "watch: --seconds: -1 is not a positive number"),
                (("plan", "m", "--runs", 0), "plan: --runs: Value 0 not in range 1 to 12"),
                (("run", "c.json", "--resume", db), "run: give campaign or --resume, not both"),
                (("run", "--resume", "--socket", "/s"), "run: --resume: is an option; name the databases")):
            with self.subTest(words=words):
                said = self.refused(*words)
                self.assertIn(sentence, said)
                self.assertEqual(said.count("\n"), 1)

    def test_a_bad_command_line_is_an_object_with_json(self):
        result = run("drop", self.database, "--json", "--sink-speed", "fast")
        self.assertEqual(result.returncode, 2)
        self.assertIn("is not a number", json.loads(result.stdout)["error"])

    def test_help_and_version_are_understood_as_words(self):
        self.assertEqual(run("help", "note").stdout, run("note", "--help").stdout)
        self.assertEqual(run("help").stdout, run("--help").stdout)
        self.assertEqual(run("version").stdout, run("--version").stdout)
        self.assertIn('there is no command "hepl"', self.refused("help", "hepl"))

    def test_a_file_of_another_kind_is_named_once(self):
        rig, model = EXAMPLES / "rig-simulated.json", EXAMPLES / "model-oleo.json"
        for words, kind in ((("run", rig), "shaker-campaign/1"), (("run", model), "shaker-campaign/1"),
                            (("plan", rig, "--rig", rig), "shaker-model/1"),
                            (("plan", model, "--rig", model), "shaker-rig/1"),
                            (("estimate", self.database, "--model", rig), "shaker-model/1")):
            with self.subTest(words=words):
                said = self.refused(*words)
                self.assertIn(f'is another kind of file; "{kind}" is wanted here', said)
                self.assertEqual(said.count("\n"), 1)  # and nothing of its keys

    def test_a_database_is_no_json_file(self):
        rig = EXAMPLES / "rig-simulated.json"
        for words in (("plan", self.database, "--rig", rig), ("run", self.database),
                      ("estimate", self.database, "--model", self.database)):
            with self.subTest(words=words):
                self.assertIn(f"{self.database}: is a campaign database, and a JSON file is wanted here",
                              self.refused(*words))

    def test_the_wrong_place_is_told_with_the_right_one(self):
        db, model, rig = self.database, EXAMPLES / "model-oleo.json", EXAMPLES / "rig-simulated.json"
        file = self.write("file", "x")
        before = sorted(os.listdir(self.path))
        for words, sentence in (
                (("campaigns", db), f"{db}: is a file; `shakerctl show {db}` shows a campaign"),
                (("campaigns", self.path / "none"), "none: No such file or directory; give the folder that holds"),
                (("estimate", model), "model-oleo.json: is neither a campaign database (.db) nor a campaign's folder"),
                (("export", db, "--format", "mat", "--directory", file), "file: cannot be written: Not a directory"),
                (("export", db, "--directory", file), "file: cannot be written: Not a dir"),
                (("export", db, "--format", "uff", "--directory", file / "in"), "in: cannot be written: Not a dir"),
                (("plan", model, "--rig", rig, "--write", file), "file: exists, and is not replaced; name another")):
            with self.subTest(words=words):
                self.assertIn(sentence, self.refused(*words))
        self.assertEqual(file.read_text(), "x")
        self.assertEqual(sorted(os.listdir(self.path)), before)

    def test_one_run_is_not_counted_as_several(self):
        one = self.write("one.json", json.dumps({
            "format": "shaker-campaign/1", "name": "one", "model": str(EXAMPLES / "model-oleo.json"),
            "runs": [{"name": "a", "frequency_hz": 2, "amplitude": 2, "cycles": 5}]}))
        self.assertIn("campaign one: 1 run\n", run("check", one).stdout)


if __name__ == "__main__":
    unittest.main()
