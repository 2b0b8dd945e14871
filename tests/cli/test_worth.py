"""What estimates are worth, on the command line: monte-carlo, plan, and estimate's options."""
import json
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
EXAMPLES = ROOT / "config" / "examples"
SHAKERCTL = os.environ["SHAKERCTL"]


def run(*words):
    return subprocess.run([SHAKERCTL, *map(str, words)], capture_output=True, text=True, timeout=120)


class MonteCarlo(unittest.TestCase):
    def test_scores_the_papers_experiments(self):
        result = run("monte-carlo", "--figure", 12, "--replications", 300, "--profile", "--json")
        self.assertEqual(result.returncode, 0, result.stderr)
        answer = json.loads(result.stdout)
        self.assertEqual(answer["converged"], 300)
        self.assertEqual([p["name"] for p in answer["parameters"]],
                         ["theta1", "theta2", "theta3", "theta4"])
        for p in answer["parameters"]:
            self.assertGreater(p["coverage"], 0.90)
            self.assertGreater(p["profile_coverage"], 0.90)
            self.assertLess(abs(p["discretisation"]), 1e-3)
        table = run("monte-carlo", "--figure", 12, "--replications", 20).stdout
        self.assertIn("20 of 20 replications converged", table)

    def test_the_answer_is_the_same_for_any_number_of_threads(self):
        words = ("monte-carlo", EXAMPLES / "model-oleo.json", "--frequency", 1, 2, "--amplitude", 3,
                 "--noise", 1e-4, "--replications", 64, "--json")
        one, three = run(*words, "--threads", 1), run(*words, "--threads", 3)
        self.assertEqual(one.returncode, 0, one.stderr)
        self.assertEqual(one.stdout, three.stdout)

    def test_says_what_is_missing(self):
        oleo = EXAMPLES / "model-oleo.json"
        for words, sentence in (((), "model file"), ((oleo,), "--frequency"),
                                ((oleo, "--frequency", 1, 2, 3, "--amplitude", 1, 2), "3 frequencies"),
                                ((oleo, "--frequency", 1, "--amplitude", 3), "--noise"),
                                (("--figure", 5), "no figure 5")):
            with self.subTest(words=words):
                result = run("monte-carlo", *words)
                self.assertEqual(result.returncode, 2)
                self.assertIn(sentence, result.stderr)


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], "-v"])
