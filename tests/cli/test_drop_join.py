"""A measured drop that joins the estimate. The truth is the linear oscillator in closed form, and one with dry
friction by this file's own Runge-Kutta steps."""
import json
import math
import os
import pathlib
import random
import tempfile
import unittest

from support import run
from test_diagnose import MODEL, response
from test_drop import DAMPING, STIFFNESS, true_drop, true_motion

NOISE, STEP = 2e-5, 1e-3


def with_friction(speed, friction, steps=20):
    """Stroke at equal steps from touch-down."""
    def pull(u, v):
        return -DAMPING * v - STIFFNESS * u - friction * math.tanh(v / 1e-3)
    u, v, h, path = 0.0, speed, STEP / steps, []
    for i in range(600 * steps):
        if i % steps == 0:
            path.append(u)
        a = pull(u, v)
        b = pull(u + h / 2 * v, v + h / 2 * a)
        c = pull(u + h / 2 * (v + h / 2 * a), v + h / 2 * b)
        d = pull(u + h * (v + h / 2 * b), v + h * c)
        u, v = u + h * v + h * h / 6 * (a + b + c), v + h / 6 * (a + 2 * b + 2 * c + d)
    return path


class Join(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.path = pathlib.Path(folder.name)
        cls.campaign, cls.out = cls.path / "campaign", cls.path / "out"
        cls.campaign.mkdir()
        runs = []
        for i, frequency in enumerate((0.8, 1.3, 2.1), 1):
            (cls.campaign / f"r{i}.csv").write_text(response(frequency))
            runs.append({"name": f"r{i}", "frequency_hz": frequency, "amplitude": 2.0})
        (cls.campaign / "campaign.json").write_text(
            json.dumps({"format": "shaker-campaign/1", "runs": runs}))
        (cls.path / "model.json").write_text(json.dumps(MODEL))
        made = cls.call("diagnose", cls.campaign, "--model", cls.path / "model.json", "--out", cls.out)
        assert made.returncode == 0, made.stderr

    @classmethod
    def call(cls, *words):
        return run(*words, env={**os.environ, "XDG_CACHE_HOME": str(cls.path / "cache")})

    def measured(self, strokes, header="t,stroke"):
        draw = random.Random(8)
        file = self.path / "measured.csv"
        file.write_text(header + "\n" + "".join(f"{STEP * i!r},{stroke + draw.gauss(0, NOISE)!r}\n"
                                                for i, stroke in enumerate(strokes)))
        return file

    def closed_form(self, speed):
        return [true_motion(speed, STEP * i)[0] for i in range(600)]

    def drop(self, speed, *words):
        return self.call("drop", self.campaign, "--diagnosis", self.out, "--sink-speed", speed, *words)

    def joined(self, speed, *words, code=0):
        result = self.drop(speed, "--join", "--json", *words)
        self.assertEqual(result.returncode, code, result.stdout[:2000] + result.stderr)
        said = json.loads(result.stdout)
        before = {f["name"]: f for f in said["figures"]}
        return before, {f["name"]: f for f in said["joined"]["figures"]}, said

    def width(self, figure):
        return figure["interval"][1] - figure["interval"][0]

    def test_a_drop_that_agrees_narrows_the_interval_and_it_holds(self):
        page = self.path / "drop.html"
        before, after, said = self.joined(2, "--measured", self.measured(self.closed_form(2.0)), "--page", page)
        self.assertTrue(said["joined"]["intervals_hold"])
        self.assertAlmostEqual(said["joined"]["noise"] / NOISE, 1.0, delta=0.2)
        self.assertTrue(said["joined"]["hypotheses"][0]["joined"])
        for name, truth in zip(("peak_stroke", "time_of_peak_stroke"), true_drop(2.0)):
            low, high = after[name]["interval"]
            self.assertLess(low, truth, name)
            self.assertGreater(high, truth, name)
            self.assertLess(self.width(after[name]), self.width(before[name]), name)
        words = page.read_text()
        for part in ("with the measured drop in the estimate", "95 % with the measured drop", "agrees with"):
            self.assertIn(part, words)
        text = self.drop(2, "--join", "--measured", self.path / "measured.csv").stdout
        self.assertIn("with the measured drop", text)
        self.assertIn("agrees with", text)

    def test_a_drop_that_disagrees_says_so_and_narrows_nothing(self):
        before, after, said = self.joined(2, "--measured", self.measured(with_friction(2.0, 0.3)), code=6)
        joined = said["joined"]
        self.assertFalse(joined["intervals_hold"])
        self.assertTrue(any("disagrees" in warning for warning in said["warnings"]))
        self.assertFalse(any(h["agrees"] or h["joined"] for h in joined["hypotheses"][:1]))
        self.assertGreater(joined["hypotheses"][0]["left"], 2 * NOISE)
        for name in ("peak_stroke", "peak_load", "efficiency"):
            self.assertGreaterEqual(self.width(after[name]), 0.999 * self.width(before[name]), name)
        result = self.drop(2, "--join", "--measured", self.path / "measured.csv")
        self.assertEqual(result.returncode, 6)
        self.assertIn("! the intervals do not hold", result.stdout)

    def test_the_measured_drop_may_have_fallen_otherwise(self):
        file = self.measured(self.closed_form(1.0))
        before, after, said = self.joined(3, "--measured", file, "--measured-sink-speed", 1)
        self.assertTrue(said["joined"]["intervals_hold"])
        self.assertEqual(said["measured"]["sink_speed"], 1.0)
        truth = true_drop(3.0)[0]
        low, high = after["peak_stroke"]["interval"]
        self.assertLess(low, truth)
        self.assertGreater(high, truth)
        self.assertLess(self.width(after["peak_stroke"]), self.width(before["peak_stroke"]))
        errors = {f["name"]: f for f in said["measured"]["figures"]}
        self.assertAlmostEqual(errors["peak_stroke"]["measured"], true_drop(1.0)[0], delta=5 * NOISE)
        # Without its own sink speed it is a drop that the damper cannot have made.
        self.joined(3, "--measured", file, code=6)
        # With twice the mass on the damper it is an oscillator of half the forces.
        decay, stiffness = DAMPING / 4, STIFFNESS / 2
        damped = math.sqrt(stiffness - decay ** 2)
        heavy = [1.0 / damped * math.exp(-decay * STEP * i) * math.sin(damped * STEP * i) for i in range(900)]
        words = ("--measured", self.measured(heavy), "--measured-sink-speed", 1, "--mass", 500)
        _, after, said = self.joined(3, *words, "--measured-mass", 1000)
        self.assertTrue(said["joined"]["intervals_hold"], said["joined"])
        low, high = after["peak_stroke"]["interval"]
        self.assertLess(low, truth)
        self.assertGreater(high, truth)
        self.joined(3, *words, code=6)

    def test_a_stated_noise_counts(self):
        # A transducer that is 0.3 % off is no noise of the record, but it is within the noise that is stated.
        file = self.measured([1.003 * stroke for stroke in self.closed_form(2.0)])
        self.joined(2, "--measured", file, code=6)
        _, _, said = self.joined(2, "--measured", file, "--measured-noise", "3mm")
        self.assertAlmostEqual(said["joined"]["noise"], 0.003, delta=1e-12)

    def test_what_cannot_join_is_told(self):
        def refused(*words):
            result = self.drop(2, *words)
            self.assertEqual(result.returncode, 2, result.stdout)
            return result.stderr
        file = self.measured(self.closed_form(2.0))
        self.assertIn("--measured", refused("--join"))
        self.assertIn("above 0", refused("--join", "--measured", file, "--measured-noise", "0mm"))
        self.assertIn("has no unit", refused("--join", "--measured", file, "--measured-noise", "3"))
        load = self.measured(self.closed_form(2.0), "t,acceleration")
        self.assertIn("has no stroke", refused("--join", "--measured", load))
        result = self.call("drop", "--model", self.path / "model.json", "--sink-speed", 2, "--measured", file,
                           "--join")
        self.assertEqual(result.returncode, 2)
        self.assertIn("--diagnosis", result.stderr)


if __name__ == "__main__":
    unittest.main()
