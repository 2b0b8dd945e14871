"""`shakerctl diagnose` and the folder of its answer."""
import json
import math
import os
import resource
import subprocess
import unittest

from support import MAKE_CAMPAIGN, Scratch, run

MODEL = {"name": "linear", "effects": [
    {"effect": "viscous_damping", "parameters": {"c": {"start": 3}}},
    {"effect": "linear_stiffness", "parameters": {"k": {"start": 120}}}]}


def stroke(frequency, t, damping=2.0, stiffness=100.0, amplitude=2.0):
    """Of the linear oscillator in closed form."""
    omega = 2 * math.pi * frequency
    phasor = amplitude / complex(stiffness - omega * omega, omega * damping)
    return abs(phasor) * math.cos(omega * t + math.atan2(phasor.imag, phasor.real))


def response(frequency, amplitude=2.0, seed=0):
    """The stroke, with noise that repeats for each seed."""
    omega = 2 * math.pi * frequency
    lines = ["t,excitation,displacement"]
    for i in range(1500):
        t = i / (100 * frequency)
        noise = 1e-5 * math.sin(12345.678 * i * i + seed)
        u = stroke(frequency, t) + noise
        lines.append(f"{t:.9f},{amplitude * math.cos(omega * t):.9f},{u:.9f}")
    return "\n".join(lines) + "\n"


class Diagnose(Scratch):
    def setUp(self):
        super().setUp()
        runs = []
        for i, frequency in enumerate((0.8, 1.3, 2.1), 1):
            self.write(f"r{i}.csv", response(frequency))
            runs.append({"name": f"r{i}", "frequency_hz": frequency, "amplitude": 2.0})
        self.write("campaign.json", json.dumps({"format": "shaker-campaign/1", "runs": runs}))
        self.model = self.write("model.json", json.dumps(MODEL))

    def diagnose(self, *words, **more):
        return run("diagnose", self.path, "--model", self.model, *words, **more,
                   env={**os.environ, "XDG_CACHE_HOME": str(self.path / "cache")})

    def test_the_answer_is_in_its_folder_and_printed(self):
        result = self.diagnose("--out", self.path / "new/out", "--json")
        self.assertEqual(result.returncode, 0, result.stderr)
        written = json.loads((self.path / "new/out/diagnosis.json").read_text())
        self.assertEqual(json.loads(result.stdout), written)
        self.assertEqual(sorted(p.name for p in (self.path / "new/out").iterdir()),
                         ["diagnosis.json", "hypotheses.json", "model.json", "report.html"])

    def test_it_says_that_an_earlier_diagnosis_will_be_replaced(self):
        first, second = (self.diagnose("--out", self.path / "out", "--json") for _ in range(2))
        self.assertEqual(first.stderr, "")
        self.assertEqual(second.stderr, f"shakerctl: {self.path}/out holds an earlier diagnosis: diagnosis.json, "
                                        "model.json, hypotheses.json, report.html will be replaced\n")
        self.assertEqual(json.loads(second.stdout)["verdict"], "adequate")

    def test_the_report_says_when_and_of_what_it_is(self):
        self.diagnose("--out", self.path / "out")
        page = (self.path / "out/report.html").read_text()
        self.assertIn(f"<th>data</th><td>{self.path.resolve()}</td>", page)
        self.assertRegex(page, r"<th>diagnosed</th><td>20\d\d-\d\d-\d\d \d\d:\d\d:\d\d UTC by shakerctl \d")

    def test_a_folder_does_not_know_its_model(self):
        result = run("diagnose", self.path)
        self.assertEqual(result.returncode, 2)
        self.assertIn("only a campaign database (.db) knows its model; give --model", result.stderr)

    def test_a_database_brings_its_own_model(self):
        table = self.write("table.csv", "".join(
            f"{f},2.0," + ",".join(f"{stroke(f, i / 64 / f):.12f}" for i in range(64)) + "\n" for f in (0.8, 1.3, 2.1)))
        made = subprocess.run([MAKE_CAMPAIGN, self.path, table, self.model, "12"], check=True, capture_output=True, text=True)
        database = made.stdout.strip()
        result = run("diagnose", database, "--out", self.path / "out", "--json",
                     env={**os.environ, "XDG_CACHE_HOME": str(self.path / "cache")})
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertEqual(json.loads(result.stdout)["model"], "linear")
        page = (self.path / "out/report.html").read_text()
        self.assertIn("<th>rig</th><td>none</td>", page)
        self.assertIn("<td>2026-03-01 12:00:00 UTC to 2026-03-01 12:01:00 UTC, success</td>", page)

    def test_the_model_that_is_diagnosed_is_not_replaced(self):
        (self.path / "other").mkdir()
        (self.path / "other/model.json").symlink_to(self.model)
        for folder in (self.path, self.path / "other"):
            result = self.diagnose("--out", folder)
            self.assertEqual(result.returncode, 2)
            self.assertIn("is the model that is diagnosed", result.stderr)
            self.assertEqual(result.stdout, "")
        self.assertEqual(json.loads(self.model.read_text()), MODEL)
        self.assertFalse((self.path / "diagnosis.json").exists())

    def test_a_folder_that_cannot_be_written_is_refused_before_the_work(self):
        (self.path / "folder/report.html").mkdir(parents=True)
        for out in (self.write("file", ""), "/proc/nowhere", self.path / "folder"):
            result = self.diagnose("--out", out)
            self.assertEqual(result.returncode, 2, result.stdout)
            self.assertIn(str(out), result.stderr)
            self.assertFalse((self.path / "cache").exists())
        self.assertEqual([p.name for p in (self.path / "folder").iterdir()], ["report.html"])

    def test_an_answer_that_cannot_be_written_is_printed_all_the_same(self):
        result = self.diagnose(
            "--out", self.path / "out", "--json", restore_signals=False,
            preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (1000, 1000)))
        self.assertEqual(result.returncode, 2)
        self.assertIn("diagnosis.json: cannot be written", result.stderr)
        self.assertEqual(json.loads(result.stdout)["verdict"], "adequate")
        self.assertEqual(list((self.path / "out").iterdir()), [])


if __name__ == "__main__":
    unittest.main()
