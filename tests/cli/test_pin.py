"""A metering pin as a table: campaigns and drops of an oleo whose orifice follows an area of this file's own, by
Runge and Kutta. Standard library alone."""
import json
import math
import os
import random
import unittest

from support import Scratch, run

THETA = (14.0, 1.6, 5.0, 1.1)
G = 9.80665
KNOTS = [0.135, 0.145, 0.155, 0.165, 0.175]
RUNS = ((0.8, 2.0), (1.5, 2.5), (2.0, 3.0), (3.0, 3.5))
CYCLES, POINTS, STEPS, NOISE = 16, 64, 256, 5e-5


def no_pin(_):
    return 1.0


def cone(u):
    """An orifice that a pin closes smoothly by 40 %, over that at the first knot."""
    def area(stroke):
        share = min(max((stroke - 0.12) / 0.07, 0.0), 1.0)
        return 1 - 0.4 * share * share * (3 - 2 * share)
    return area(u) / area(KNOTS[0])


def rates(area, x, u, v, damping=0.0):
    t1, t2, t3, t4 = THETA
    return v, x - t1 * abs(v) * v / area(u) ** 2 - damping * v - t2 * (1 - t3 * u) ** -t4 + G


def step(area, force, t, h, u, v, damping=0.0):
    a = rates(area, force(t), u, v, damping)
    b = rates(area, force(t + h / 2), u + h / 2 * a[0], v + h / 2 * a[1], damping)
    c = rates(area, force(t + h / 2), u + h / 2 * b[0], v + h / 2 * b[1], damping)
    d = rates(area, force(t + h), u + h * c[0], v + h * c[1], damping)
    return (u + h / 6 * (a[0] + 2 * b[0] + 2 * c[0] + d[0]), v + h / 6 * (a[1] + 2 * b[1] + 2 * c[1] + d[1]))


def response(area, frequency, amplitude, draw, damping=0.0):
    """A CSV file of the settled motion."""
    omega, h = 2 * math.pi * frequency, 1 / frequency / STEPS
    u, v = 0.16, 0.0
    lines = ["t,excitation,displacement"]
    for i in range((20 + CYCLES) * STEPS + 1):
        t = i * h
        if i >= 20 * STEPS and i % (STEPS // POINTS) == 0:
            lines.append(f"{t:.9f},{amplitude * math.cos(omega * t):.9f},{u + draw.gauss(0, NOISE):.9f}")
        u, v = step(area, lambda s: amplitude * math.cos(omega * s), t, h, u, v, damping)
    return "\n".join(lines) + "\n"


def peak_of_drop(area, speed):
    """The greatest load per mass and the greatest stroke."""
    t1, t2, t3, t4 = THETA
    u, v, h, load = 0.0, speed, 2e-5, 0.0
    while v > 0:
        load = max(load, t1 * v * v / area(u) ** 2 + t2 * (1 - t3 * u) ** -t4)
        u, v = step(area, lambda _: 0.0, 0.0, h, u, v)
    return load, u


def model(table=None, theta=THETA):
    effects = [{"effect": "orifice_damping", "parameters": {"theta1": {"start": theta[0]}}},
               {"effect": "gas_spring",
                "parameters": {f"theta{k}": {"start": theta[k - 1]} for k in (2, 3, 4)}},
               {"effect": "gravity"}]
    if table:
        effects.insert(1, {"effect": "tabulated_pin", "table": table})
    return {"name": "pinned", "effects": effects}


class Pin(Scratch):
    def campaign(self, area, damping=0.0):
        folder, draw = self.path / "campaign", random.Random(4)
        folder.mkdir()
        runs = []
        for i, (frequency, amplitude) in enumerate(RUNS, 1):
            (folder / f"r{i}.csv").write_text(response(area, frequency, amplitude, draw, damping))
            runs.append({"name": f"r{i}", "frequency_hz": frequency, "amplitude": amplitude})
        (folder / "campaign.json").write_text(json.dumps({"format": "shaker-campaign/1", "runs": runs}))
        return folder

    def said(self, *words, status=0):
        result = run(*words, "--json", env={**os.environ, "XDG_CACHE_HOME": str(self.path / "cache")})
        self.assertEqual(result.returncode, status, result.stderr)
        return json.loads(result.stdout)

    def estimated(self, area, status=0):
        spec = self.write("m.json", json.dumps(model({"stroke": KNOTS})))
        return self.said("estimate", self.campaign(area), "--model", spec, status=status)

    def test_the_areas_are_found_with_intervals(self):
        table = self.estimated(cone)["pin_table"]
        self.assertEqual([row["stroke"] for row in table], KNOTS)
        for row in table:
            low, high = row["interval"]
            self.assertLessEqual(low, cone(row["stroke"]) + 1e-9, row)
            self.assertGreaterEqual(high, cone(row["stroke"]) - 1e-9, row)
            self.assertLess(high - low, 0.1, row)
        self.assertAlmostEqual(table[-1]["area"] / cone(KNOTS[-1]), 1, delta=0.03)

    def test_an_orifice_without_a_pin_has_equal_areas(self):
        said = self.estimated(no_pin)
        fall = next(p for p in said["parameters"] if p["name"] == "fall")
        self.assertLess(abs(fall["value"]), 3 * fall["standard_error"])
        for row in said["pin_table"]:
            self.assertLessEqual(row["interval"][0], 1 + 1e-9, row)
            self.assertGreaterEqual(row["interval"][1], 1 - 1e-9, row)

    def test_a_drop_follows_the_table_and_goes_on_beyond_it(self):
        # Areas that fall by a fixed share for each millimetre: what the table's cubic and its lines are exact for.
        def law(u):
            return math.exp(-4 * u)
        knots = [0.02, 0.05, 0.09, 0.15]
        theta1 = THETA[0] / law(knots[0]) ** 2
        spec = self.write("m.json", json.dumps(
            model({"stroke": knots, "area": [80 * law(u) for u in knots]}, (theta1, *THETA[1:]))))
        figures = {f["name"]: f["value"] for f in self.said("drop", "--model", spec, "--sink-speed", 2)["figures"]}
        load, stroke = peak_of_drop(law, 2.0)
        self.assertAlmostEqual(figures["peak_load"] / load, 1, delta=1e-4)
        self.assertAlmostEqual(figures["peak_stroke"] / stroke, 1, delta=1e-4)

    def test_a_diagnosis_names_the_table_and_its_drop_holds_a_pin_that_ends(self):
        folder, spec, out = self.campaign(cone), self.write("m.json", json.dumps(model())), self.path / "out"
        said = self.said("diagnose", folder, "--model", spec, "--out", out)
        self.assertEqual((said["verdict"], said["effects"][0]["name"]), ("explained", "tabulated_pin"))
        self.assertGreater(said["effects"][0]["probability"], 0.9)
        for speed in (1, 2):
            figures = {f["name"]: f for f in self.said("drop", folder, "--diagnosis", out, "--sink-speed",
                                                       speed)["figures"]}
            for name, truth in zip(("peak_load", "peak_stroke"), peak_of_drop(cone, speed)):
                low, high = figures[name]["interval"]
                self.assertLessEqual(low, truth, name)
                self.assertGreaterEqual(high, truth, name)

    def test_what_is_not_a_pin_is_not_named_a_table(self):
        spec = self.write("m.json", json.dumps(model()))
        said = self.said("diagnose", self.campaign(no_pin, damping=0.4), "--model", spec, "--out", self.path / "out")
        self.assertEqual([e["name"] for e in said["effects"]], ["viscous_damping"])

    def test_a_table_that_is_wrong_gets_a_sentence(self):
        for table, words in (
                ({"stroke": [0.1, 0.12, 0.11, 0.15]}, "is not increasing: the stroke is 0.12 at knot 2 and 0.11 at"),
                ({"stroke": [0.1, 0.12, 0.12, 0.15]}, "is not increasing"),
                ({"stroke": [0.1, 0.12, 0.15]}, "has 3 knots; 4 to 12 are allowed"),
                ({"stroke": [0.01 * i for i in range(13)]}, "has 13 knots; 4 to 12 are allowed"),
                ({"stroke": [0.1, 0.12, 0.14, 0.16], "area": [9, 8, 8.5, 7]}, "do not decrease all along: 8 at knot 2"),
                ({"stroke": [0.1, 0.12, 0.14, 0.16], "area": [9, 8, 7]}, "has 3 areas for 4 strokes"),
                ({"stroke": [0.1, 0.12, 0.14, 0.16], "area": [9, 8, 0, 0]}, "must be above 0"),
                ({"area": [9, 8, 7, 6]}, "stroke")):
            spec = self.write("m.json", json.dumps(model(table)))
            result = run("drop", "--model", spec, "--sink-speed", 2)
            self.assertEqual(result.returncode, 2, result.stdout)
            self.assertIn(words, result.stderr)
            self.assertIn("/effects/1", result.stderr)
        wrong = model()
        wrong["effects"].append({"effect": "tabulated_pin"})
        result = run("drop", "--model", self.write("m.json", json.dumps(wrong)), "--sink-speed", 2)
        self.assertIn('wants a "table" with the strokes', result.stderr)


if __name__ == "__main__":
    unittest.main()
