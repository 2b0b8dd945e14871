"""The command line, and what happens before there is a stream."""
import json
import subprocess
import unittest

from daemon import Daemon, RIG, SHAKERD


class Start(unittest.TestCase):
    def run_it(self, rig, *words):
        daemon = Daemon(rig)
        self.addCleanup(daemon.end)
        return subprocess.run(daemon.command(*words), capture_output=True, text=True, timeout=20)

    def test_help_and_version(self):
        shown = subprocess.run([SHAKERD, "--help"], capture_output=True, text=True)
        self.assertEqual(shown.returncode, 0)
        for word in ("--rig", "--socket", "--data", "--tcp", "--check", "Exit status"):
            self.assertIn(word, shown.stdout)
        shown = subprocess.run([SHAKERD, "--version"], capture_output=True, text=True)
        self.assertRegex(shown.stdout, r"^shakerd \d+\.\d+\.\d+\n$")

    def test_check_says_what_is_in_the_rig_file(self):
        good = self.run_it(RIG, "--check")
        self.assertEqual(good.returncode, 0, good.stderr)
        self.assertIn('Rig "simulated"', good.stdout)

    def test_a_bad_rig_file_is_one_clear_complaint(self):
        bad = self.run_it(dict(RIG, surprise=1))
        self.assertEqual(bad.returncode, 2)
        self.assertIn("surprise", bad.stderr)
        self.assertIn("rig.json", bad.stderr)

    def test_bad_options(self):
        for words in ([], ["--rig"], ["--rig", "x", "--tcp", "99999"], ["--surprise"]):
            with self.subTest(words):
                bad = subprocess.run([SHAKERD, *words], capture_output=True, text=True)
                self.assertEqual(bad.returncode, 2)
                self.assertTrue(bad.stderr)

    def test_a_rig_file_that_is_not_there(self):
        bad = subprocess.run([SHAKERD, "--rig", "/nonexistent.json"], capture_output=True, text=True)
        self.assertEqual(bad.returncode, 2)
        self.assertIn("/nonexistent.json", bad.stderr)


if __name__ == "__main__":
    unittest.main()
