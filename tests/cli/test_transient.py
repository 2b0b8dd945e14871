"""estimate --transient and drop on the command line, against this file's own Runge-Kutta steps."""
import json
import pathlib
import tempfile
import unittest

from support import run

THETA = [16.6667, 1.524, 5.31496, 1.0]
GRAVITY, SPEED, STEP = 9.80665, 3.0, 2e-4
MODEL = {"name": "oleo", "gravity": GRAVITY, "length_unit": "m", "effects": [
    {"effect": "orifice_damping", "parameters": {"theta1": {"start": 16, "lower": 0}}},
    {"effect": "gas_spring", "parameters": {
        "theta2": {"start": 1.6, "lower": 0}, "theta3": {"start": 5.2, "lower": 0},
        "theta4": {"start": 1.1, "lower": 0.2, "upper": 3}}},
    {"effect": "gravity"}]}


def drop():
    """Stroke at equal steps from the touchdown on."""
    def force(u, v):
        return GRAVITY - THETA[0] * abs(v) * v - THETA[1] * (1 - THETA[2] * u) ** -THETA[3]
    u, v, path = 0.0, SPEED, []
    for _ in range(4001):
        path.append(u)
        a = force(u, v)
        u2, v2 = u + STEP / 2 * v, v + STEP / 2 * a
        b = force(u2, v2)
        u3, v3 = u + STEP / 2 * v2, v + STEP / 2 * b
        c = force(u3, v3)
        u4, v4 = u + STEP * v3, v + STEP * c
        d = force(u4, v4)
        u, v = u + STEP / 6 * (v + 2 * v2 + 2 * v3 + v4), v + STEP / 6 * (a + 2 * b + 2 * c + d)
    return path


class Drop(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.stroke = drop()

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.path = pathlib.Path(folder.name)
        self.model = self.path / "oleo.json"
        self.model.write_text(json.dumps(MODEL))
        self.record = self.path / "drop.csv"
        self.record.write_text("t,displacement\n" + "".join(
            f"{i * STEP!r},{u!r}\n" for i, u in enumerate(self.stroke) if i % 20 == 0))

    def test_is_identified_and_predicted_again(self):
        result = run("estimate", self.record, "--transient", "--model", self.model, "--initial", "0,3",
                     "--json")
        self.assertEqual(result.returncode, 0, result.stderr)
        document = json.loads(result.stdout)
        for p, theta in zip(document["parameters"], THETA, strict=True):
            self.assertAlmostEqual(p["value"] / theta, 1.0, delta=1e-6)
        estimate = self.path / "estimate.json"
        estimate.write_text(result.stdout)
        picture = self.path / "drop.svg"
        predicted = run("drop", "--model", self.model, "--estimate", estimate, "--sink-speed", SPEED, "--svg",
                        picture, "--json")
        self.assertEqual(predicted.returncode, 0, predicted.stderr)
        figures = {f["name"]: f for f in json.loads(predicted.stdout)["figures"]}
        self.assertAlmostEqual(figures["peak_stroke"]["value"] / max(self.stroke), 1.0, delta=1e-6)
        self.assertAlmostEqual(figures["peak_deceleration"]["value"],
                               THETA[0] * SPEED ** 2 + THETA[1] - GRAVITY, delta=1e-3)
        self.assertIn("<svg", picture.read_text())

    def test_loads_are_not_per_mass_where_a_mass_is_given(self):
        words = ("drop", "--model", self.model, "--sink-speed", SPEED)
        self.assertIn("peak load per mass ", run(*words).stdout)
        result = run(*words, "--mass", 100)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertNotIn("per mass", result.stdout)
        self.assertRegex(result.stdout, r"peak load +\d+ .* N\n")

    def test_says_what_is_missing(self):
        for words, sentence in (
                (("estimate", self.record, "--transient"), "--model"),
                (("estimate", self.record, "--transient", "--model", self.model, "--frequency", 2),
                 "--frequency"),
                (("drop", "--model", self.model), "sink"),
                (("estimate", self.path / "none.csv", "--transient", "--model", self.model),
                 "cannot be read")):
            with self.subTest(words=words):
                result = run(*words)
                self.assertEqual(result.returncode, 2, result.stdout)
                self.assertIn(sentence, result.stderr)


if __name__ == "__main__":
    unittest.main()
