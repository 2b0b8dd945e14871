"""One damper, measured in other units and beside another mass: `shakerctl diagnose` gives the same answer. The
motions come from closed forms and from Runge and Kutta's steps here."""
import json
import math
import os
import random
import unittest

from support import Scratch, run
from sanitized import some

BASE = ("viscous_damping", "c", 3.0), ("linear_stiffness", "k", 60.0)


def rounded_sign(speed, width):
    return math.tanh(speed / width)


def dynamometer():
    """t, displacement, force of imposed motions; friction is what the model lacks."""
    source = random.Random(1)
    for frequency, half_stroke in ((1.0, 0.02), (2.0, 0.02), (3.0, 0.015), (1.5, 0.01)):
        omega = 2 * math.pi * frequency
        rows = []
        for i in range(2400):
            t = i / (200 * frequency)
            u, v = half_stroke * math.sin(omega * t), half_stroke * omega * math.cos(omega * t)
            rows.append((t, u, 60 * u + 4 * v + 0.5 * rounded_sign(v, 4e-3) + 0.01 * source.gauss(0, 1)))
        yield {"kind": "imposed_motion", "frequency_hz": frequency}, rows


def stepped(rate, state, t, h):
    """One step of Runge and Kutta's."""
    def moved(by, slope):
        return [x + by * k for x, k in zip(state, slope)]
    k1 = rate(t, state)
    k2 = rate(t + h / 2, moved(h / 2, k1))
    k3 = rate(t + h / 2, moved(h / 2, k2))
    k4 = rate(t + h, moved(h, k3))
    return [x + h / 6 * (a + 2 * b + 2 * c + d) for x, a, b, c, d in zip(state, k1, k2, k3, k4)]


def recorded(rate, state, seconds, per_second, table=None):
    """t, excitation if there is any, displacement: the first state."""
    source, rows = random.Random(1), []
    for i in range(int(seconds * per_second)):
        t = i / per_second
        rows.append((t, *([table(t)] if table else []), state[0] + 2e-5 * source.gauss(0, 1)))
        for k in range(10):
            state = stepped(rate, state, t + k / (10 * per_second), 1 / (10 * per_second))
    return rows


def decays():
    """Of a mass that is let go; friction is what the model lacks."""
    def rate(t, s):
        return [s[1], -60 * s[0] - 0.4 * s[1] - 0.03 * rounded_sign(s[1], 2e-4)]
    for start in (0.08, 0.05):
        yield {"kind": "transient"}, recorded(rate, [start, 0.0], 6, 100)


def decays_with_play():
    """Of a mass whose spring and damper are joined to it with a play, the third state their stroke."""
    def stop(y):
        return 4000 * (max(0.0, y - 1e-3) - max(0.0, -y - 1e-3))

    def rate(t, s):
        load = stop(s[0] - s[2])
        return [s[1], -load, (load - 60 * s[2]) / 3.0]
    for start in (0.08, 0.05):
        yield {"kind": "transient"}, recorded(rate, [start, 0.0, start - 1e-3 - 60 * start / 4000], 6, 100)


def swept(duration, from_hz, to_hz, amplitude):
    return lambda t: min(1.0, t) * amplitude * math.sin(
        2 * math.pi * (from_hz * t + (to_hz - from_hz) * t * t / (2 * duration)))


def sweeps_on_a_tyre():
    """The base is a mass on a tyre, whose deflection is the third state."""
    for table in (swept(8, 0.6, 4, 2.0), swept(8, 4, 1, 2.0)):
        def rate(t, s, table=table):
            u, v, y, w = s
            force = 60 * u + 3 * v
            # u'' + y'' + force = x and 1.2 (y'' - x) + 1 y' + 1500 y + u'' = 0
            bend = (0.2 * table(t) + force - 1.0 * w - 1500 * y) / 0.2
            return [v, table(t) - force - bend, w, bend]
        yield {"kind": "transient"}, recorded(rate, [0.0, 0.0, 0.0, 0.0], 8, 100, table)


def shaken():
    """t, excitation, displacement of an oscillator; friction and a cubic spring are what the model lacks."""
    source = random.Random(1)
    for frequency, amplitude in ((1.2, 3.0), (1.8, 3.0), (2.6, 4.0), (1.5, 1.5)):
        omega = 2 * math.pi * frequency

        def rate(t, u, v):
            return v, amplitude * math.cos(omega * t) - 100 * u - 2 * v - 0.25 * rounded_sign(v, 4e-3) - 6e3 * u ** 3

        rows, u, v, h = [], 0.0, 0.0, 1 / (400 * frequency)
        for i in range(400 * 60):
            t = i * h
            if i >= 400 * 45 and i % 4 == 0:
                rows.append((t - 45 / frequency, amplitude * math.cos(omega * t), u + 2e-5 * source.gauss(0, 1)))
            k1 = rate(t, u, v)
            k2 = rate(t + h / 2, u + h / 2 * k1[0], v + h / 2 * k1[1])
            k3 = rate(t + h / 2, u + h / 2 * k2[0], v + h / 2 * k2[1])
            k4 = rate(t + h, u + h * k3[0], v + h * k3[1])
            u += h / 6 * (k1[0] + 2 * k2[0] + 2 * k3[0] + k4[0])
            v += h / 6 * (k1[1] + 2 * k2[1] + 2 * k3[1] + k4[1])
        yield {"frequency_hz": frequency, "amplitude": amplitude}, rows


class Scale(Scratch):
    def answer(self, header, runs, columns, starts, **more):
        """`columns`: what each column is multiplied by; `starts`: of the model's two parameters."""
        listed = []
        for i, (said, rows) in enumerate(runs, 1):
            lines = [",".join(f"{x * by:.13e}" for x, by in zip(row, columns)) for row in rows]
            self.write(f"r{i}.csv", "\n".join([header, *lines]) + "\n")
            said = dict(said, name=f"r{i}")
            if "amplitude" in said:
                said["amplitude"] *= columns[1]
            listed.append(said)
        self.write("campaign.json", json.dumps({"format": "shaker-campaign/1", "runs": listed, **more}))
        model = self.write("model.json", json.dumps({"name": "linear", "effects": [
            {"effect": effect, "parameters": {symbol: {"start": start * by}}}
            for (effect, symbol, start), by in zip(BASE, starts)]}))
        result = run("diagnose", self.path, "--model", model, "--json",
                     env={**os.environ, "XDG_CACHE_HOME": str(self.path / "cache")})
        self.assertEqual(result.returncode, 0, result.stderr)
        return json.loads(result.stdout)

    def same(self, one, other):
        self.assertEqual(other["verdict"], one["verdict"])
        self.assertEqual([e["name"] for e in other["effects"]], [e["name"] for e in one["effects"]])
        for a, b in zip(one["effects"], other["effects"]):
            self.assertAlmostEqual(a["probability"], b["probability"], delta=1e-6, msg=a["name"])

    def test_of_a_force_neither_mass_nor_unit_matters(self):
        runs = list(dynamometer())
        one = self.answer("t,displacement,force", runs, (1, 1, 1), (1, 1))
        self.assertEqual((one["verdict"], [e["name"] for e in one["effects"]]), ("explained", ["coulomb_friction"]))
        for mass in some((10, None, 100, 1000)):  # a force of 1 kN and less, beside masses that are only said
            said, kg = ({"reference_mass": mass}, mass) if mass else ({}, 1)
            with self.subTest(mass=mass):
                self.same(one, self.answer("t,displacement,force", runs, (1, 1, 200), (200 / kg, 200 / kg),
                                           units={"force": "N"}, **said))
        for unit in some((57.3, 1e3, 1e-4)):  # degrees of a radian, millimetres, strain
            with self.subTest(unit=unit):
                self.same(one, self.answer("t,displacement,force", runs, (1, unit, 1), (1 / unit, 1 / unit),
                                           units={"displacement": {"label": "mV", "scale": 1}}))

    def test_of_a_shaken_mass_the_unit_does_not_matter(self):
        runs = list(shaken())
        one = self.answer("t,excitation,displacement", runs, (1, 1, 1), (1, 2))
        self.assertEqual((one["verdict"], sorted(e["name"] for e in one["effects"])),
                         ("explained", ["coulomb_friction", "cubic_stiffness"]))
        for unit in some((57.3, 1e3, 1e-4)):
            with self.subTest(unit=unit):
                self.same(one, self.answer("t,excitation,displacement", runs, (1, unit, unit), (1, 2),
                                           units={"displacement": {"label": "mV", "scale": 1}}))

    def the_unit_of_records_does_not_matter(self, runs, truth):
        columns = len(runs[0][1][0])
        header = "t,excitation,displacement" if columns == 3 else "t,displacement"
        one = self.answer(header, runs, (1, 1, 1), (1, 1))
        # A friction that turns round gently may be called one that falls with speed.
        self.assertIn(truth, [one["effects"][0]["name"], *one["effects"][0]["confusable_with"]])
        for unit in some((1e3, 1e-4)):
            with self.subTest(unit=unit):
                self.same(one, self.answer(header, runs, (1, unit, unit), (1, 1),
                                           units={"displacement": {"label": "mV", "scale": 1}}))
        return one["verdict"]

    def test_of_decays_the_unit_does_not_matter(self):
        self.the_unit_of_records_does_not_matter(list(decays()), "coulomb_friction")

    def test_of_decays_with_a_play_the_unit_does_not_matter(self):
        verdict = self.the_unit_of_records_does_not_matter(list(decays_with_play()), "free_play")
        self.assertEqual(verdict, "explained")

    def test_of_sweeps_on_a_tyre_the_unit_does_not_matter(self):
        self.the_unit_of_records_does_not_matter(list(sweeps_on_a_tyre()), "tyre")


if __name__ == "__main__":
    unittest.main()
