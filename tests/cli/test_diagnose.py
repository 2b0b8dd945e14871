"""`shakerctl diagnose` and the folder of its answer."""
import json
import math
import os
import resource
import unittest

from support import Scratch, run

MODEL = {"name": "linear", "effects": [
    {"effect": "viscous_damping", "parameters": {"c": {"start": 3}}},
    {"effect": "linear_stiffness", "parameters": {"k": {"start": 120}}}]}


def response(frequency, damping=2.0, stiffness=100.0, amplitude=2.0):
    """Of the linear oscillator in closed form, with noise that repeats."""
    omega = 2 * math.pi * frequency
    phasor = amplitude / complex(stiffness - omega * omega, omega * damping)
    lines = ["t,excitation,displacement"]
    for i in range(1500):
        t = i / (100 * frequency)
        noise = 1e-5 * math.sin(12345.678 * i * i)
        u = abs(phasor) * math.cos(omega * t + math.atan2(phasor.imag, phasor.real)) + noise
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
                         ["diagnosis.json", "model.json", "report.html"])

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
