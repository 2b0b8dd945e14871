"""The dossier of a campaign: what stands on it, that its numbers come again from the commands that it prints,
and bad input."""
import hashlib
import html
import json
import os
import re
import shlex
import shutil
import unittest

from support import Scratch, SHAKERCTL, run
from test_diagnose import MODEL, response
from test_drop import stiffer_response


class Report(Scratch):
    def setUp(self):
        super().setUp()
        self.campaign = self.path / "campaign"
        self.campaign.mkdir()
        runs = []
        for i, frequency in enumerate((0.8, 1.3, 2.1), 1):
            (self.campaign / f"r{i}.csv").write_text(response(frequency))
            runs.append({"name": f"r{i}", "frequency_hz": frequency, "amplitude": 2.0})
        (self.campaign / "campaign.json").write_text(
            json.dumps({"format": "shaker-campaign/1", "runs": runs}))
        self.model = self.write("model.json", json.dumps(MODEL))
        self.page = self.path / "dossier.html"

    def call(self, *words):
        return run(*words, cwd=self.path, env={**os.environ, "XDG_CACHE_HOME": str(self.path / "cache")})

    def report(self, *words, code=0):
        result = self.call("report", "campaign", "--model", "model.json", *words)
        self.assertEqual(result.returncode, code, result.stdout + result.stderr)
        return result

    def words_of(self, page):
        text = re.sub(r"<svg.*?</svg>|<style>.*?</style>|<[^>]*>", " ", page.read_text(), flags=re.S)
        return re.sub(r"\s+", " ", html.unescape(text))

    def test_it_says_what_was_tested_and_how_it_falls(self):
        self.report("--out", self.page, "--sink-speed", 2, "--mass", 500, "--specimen", "left <main> gear",
                    "--serial", "SN 42", "--operator", "J. Doe", "--limit", "peak_stroke=1m")
        words = self.words_of(self.page)
        for said in ("left <main> gear", "SN 42", "J. Doe", "Nothing is missing", "r3 periodic 2.1",
                     "peak load", "peak_stroke=1m met with probability 1.0000", "does not replace the drop of a "
                     "new type", "balance of energy"):
            self.assertIn(said, words)
        self.assertIn(hashlib.sha256(self.model.read_bytes()).hexdigest(), words)
        page = self.page.read_text()
        self.assertNotRegex(page, r"(src|href)=|https?://(?!www\.w3\.org)")  # it loads nothing
        self.assertNotIn("{{", page)
        # The folder's hash is that of the seal that `verify --seal` writes.
        self.assertEqual(self.call("verify", "campaign", "--seal").returncode, 0)
        seal = (self.campaign / "campaign.sha256").read_bytes()
        self.assertIn(hashlib.sha256(seal).hexdigest(), words)

    def test_its_numbers_come_again_from_the_commands_that_it_prints(self):
        said = json.loads(self.report("--out", self.page, "--sink-speed", 2, "--mass", 500, "--serial",
                                      "it's 7", "--json").stdout)
        words = self.words_of(self.page)
        for command in said["commands"]:
            self.assertIn(command, words)
        for command in said["commands"][:-1]:
            name, *rest = shlex.split(command)
            self.assertEqual(name, "shakerctl")
            result = self.call(*rest)
            self.assertEqual(result.returncode, 0, command + result.stderr)
        # The last one printed is the drop: each of its rows stands on the page.
        rows = [line.split("  ") for line in result.stdout.splitlines() if line.startswith(("peak", "energy"))]
        self.assertGreaterEqual(len(rows), 4)
        for row in rows:
            label, value = [cell.strip() for cell in row if cell][:2]
            self.assertIn(f"{label} {value} ", words)
        own = shlex.split(said["commands"][-1])
        self.assertEqual(own[own.index("--serial") + 1], "it's 7")
        self.page.unlink()
        self.assertEqual(self.call(*own[1:]).returncode, 0)
        self.assertTrue(self.page.exists())

    def stiffer(self, frequencies):
        other = self.path / "other"
        other.mkdir(exist_ok=True)
        runs = []
        for i, frequency in enumerate(frequencies, 1):
            (other / f"r{i}.csv").write_text(stiffer_response(frequency))
            runs.append({"name": f"r{i}", "frequency_hz": frequency, "amplitude": 2.0})
        (other / "campaign.json").write_text(json.dumps({"format": "shaker-campaign/1", "runs": runs}))

    def test_two_dampers_are_told(self):
        self.stiffer((0.8, 1.3, 2.1))
        self.assertIn("contradict each other", self.report("other", "--out", self.page, code=2).stderr)
        self.assertFalse(self.page.exists())
        # Driven otherwise, no two runs contradict each other: the parameters do.
        self.stiffer((0.9, 1.5, 2.4))
        self.report("other", "--out", self.page)
        self.assertIn("They are of two dampers", self.words_of(self.page))

    def test_without_a_drop_it_has_none_and_a_drop_that_does_not_turn_is_said(self):
        self.report("--out", self.page)
        self.assertNotIn("Figures of the drop", self.words_of(self.page))
        other = self.path / "short.html"
        result = self.report("--out", other, "--sink-speed", 2, "--duration", 0.01, code=5)
        self.assertIn("longer duration", result.stderr)
        words = self.words_of(other)
        self.assertIn("There is no drop", words)
        self.assertIn("Estimate", words)

    def test_bad_input_gets_one_sentence_and_loses_nothing(self):
        self.page.write_text("mine")
        self.assertIn("is there already", self.report("--out", self.page, code=2).stderr)
        self.assertEqual(self.page.read_text(), "mine")
        self.assertIn("must end in .html or .pdf", self.report("--out", "dossier.doc", code=2).stderr)
        self.assertIn("how does it fall?", self.report("--out", "a.html", "--mass", 3, code=2).stderr)
        (self.path / "empty").mkdir()
        result = self.call("report", "empty", "--out", "a.html")
        self.assertEqual(result.returncode, 2)
        self.assertIn("is a folder without a campaign", result.stderr)
        self.assertIn("cannot be written", self.report("--out", "nowhere/a.html", code=2).stderr)
        self.report("--out", self.page, "--force")
        self.assertIn("Nothing is missing", self.words_of(self.page))

    def test_a_drop_has_a_page_of_its_own(self):
        self.assertEqual(self.call("diagnose", "campaign", "--model", "model.json", "--out", "out").returncode, 0)
        result = self.call("drop", "campaign", "--diagnosis", "out", "--sink-speed", 2, "--page", self.page)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertIn("At touch-down with 2 m/s", self.words_of(self.page))
        self.assertGreaterEqual(self.page.read_text().count("<svg"), 5)

    @unittest.skipUnless(shutil.which("weasyprint") or shutil.which("chromium"), "nothing here prints")
    def test_it_prints(self):
        paper = self.path / "dossier.pdf"
        self.report("--out", paper, "--sink-speed", 2)
        data = paper.read_bytes()
        self.assertTrue(data.startswith(b"%PDF"))
        self.assertRegex(data, rb"/MediaBox ?\[ ?0 0 59\d(\.\d+)? 84\d")  # A4
        self.assertEqual(sorted(p.name for p in self.path.glob("dossier*")), ["dossier.pdf"])

    def test_without_a_printer_it_says_what_is_missing(self):
        (self.path / "bin").mkdir()
        result = run("report", "campaign", "--model", "model.json", "--out", "dossier.pdf", cwd=self.path,
                     env={**os.environ, "PATH": str(self.path / "bin"), "HOME": str(self.path),
                          "XDG_CACHE_HOME": str(self.path / "cache")})
        self.assertEqual(result.returncode, 2, result.stderr)
        self.assertIn("needs weasyprint or Chromium", result.stderr)


if __name__ == "__main__":
    unittest.main()
