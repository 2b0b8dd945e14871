"""`shakerctl estimate` of folders whose runs are no periodic responses, against motions in closed form."""
import json
import math
import random
import unittest

from support import Scratch, run

STIFFNESS, DAMPING = 60.0, 0.8


def written(rows):
    return "".join(",".join(f"{value:.10g}" for value in row) + "\n" for row in rows)


def forces(friction):
    """t, displacement, force of a spring and a dashpot on a dynamometer."""
    source = random.Random(3)
    for frequency, half_stroke in ((1.0, 0.02), (2.0, 0.02), (3.0, 0.015)):
        omega = 2 * math.pi * frequency
        rows = []
        for i in range(2400):
            t = i / (200 * frequency)
            u, v = half_stroke * math.sin(omega * t), half_stroke * omega * math.cos(omega * t)
            force = STIFFNESS * u + DAMPING * v + friction * math.tanh(v / 4e-3)
            rows.append((t, u, force + 0.01 * source.gauss(0, 1)))
        yield {"kind": "imposed_motion", "frequency_hz": frequency}, rows


def decays(noise=2e-4):
    """t, displacement of a mass that is let go."""
    source = random.Random(4)
    rate = DAMPING / 2
    omega = math.sqrt(STIFFNESS - rate * rate)
    for start in (0.8, 0.5):
        yield {"kind": "transient"}, [
            (t, start * math.exp(-rate * t) * (math.cos(omega * t) + rate / omega * math.sin(omega * t))
             + noise * source.gauss(0, 1))
            for t in (i / 100 for i in range(800))]


class EstimateRecords(Scratch):
    def recorded(self, columns, runs, **more):
        listed = []
        for i, (said, rows) in enumerate(runs):
            self.write(f"r{i}.csv", columns + "\n" + written(rows))
            listed.append(dict(said, name=f"r{i}"))
        self.write("campaign.json", json.dumps({"format": "shaker-campaign/1", "runs": listed, **more}))

    def estimate(self, *options, unit="m", status=0):
        model = self.write("model.json", json.dumps({"name": "linear", "length_unit": unit, "effects": [
            {"effect": "linear_stiffness", "parameters": {"k": {"start": 40}}},
            {"effect": "viscous_damping", "parameters": {"c": {"start": 2}}}]}))
        result = run("estimate", self.path, "--model", model, "--json", *options)
        self.assertEqual(result.returncode, status, result.stderr + result.stdout)
        return json.loads(result.stdout)

    def holds_the_truth(self, document, mass=1.0):
        for entry, truth in zip(document["parameters"], (STIFFNESS / mass, DAMPING / mass)):
            self.assertLess(abs(entry["value"] - truth), 4 * entry["standard_error"], entry)
            self.assertLess(entry["standard_error"], 0.05 * truth, entry)
            self.assertTrue(entry["interval"][0] < entry["value"] < entry["interval"][1])
        for k in range(2):
            self.assertAlmostEqual(math.sqrt(document["covariance"][k][k]),
                                   document["parameters"][k]["standard_error"])

    def test_forces_of_a_dynamometer(self):
        self.recorded("t,displacement,force", forces(0.0))
        document = self.estimate()
        self.holds_the_truth(document)
        self.assertTrue(document["intervals_hold"])

    def test_forces_in_newtons_beside_a_mass(self):
        self.recorded("t,displacement,force", forces(0.0), units={"force": "N"}, reference_mass=4.0)
        self.holds_the_truth(self.estimate(), mass=4.0)

    def test_a_model_that_lacks_friction_says_that_its_intervals_do_not_hold(self):
        self.recorded("t,displacement,force", forces(0.5))
        document = self.estimate(status=6)
        self.assertFalse(document["intervals_hold"])
        self.assertGreater(document["gap"], 2 * document["noise_floor"])

    def test_decays_of_an_angle(self):
        self.recorded("t,displacement", decays(), units={"displacement": "rad"})
        self.holds_the_truth(self.estimate(unit="rad"))

    def test_periodic_responses_to_an_excitation_that_is_only_stated(self):
        source = random.Random(5)
        omega = 2 * math.pi * 1.5
        response = 2.0 / complex(STIFFNESS - omega * omega, DAMPING * omega)
        rows = [(t, (response * complex(math.cos(omega * t), math.sin(omega * t))).real + 1e-4 * source.gauss(0, 1))
                for t in (i / (64 * 1.5) for i in range(12 * 64))]
        self.recorded("t,displacement", [({"frequency_hz": 1.5, "amplitude": 2.0}, rows)])
        self.holds_the_truth(self.estimate())

    def test_an_option_for_mean_cycles_is_refused(self):
        self.recorded("t,displacement", decays(), units={"displacement": "rad"})
        document = self.estimate("--starts", "4", unit="rad", status=2)
        self.assertIn("--starts is for periodic responses", json.dumps(document))

    def test_a_campaign_is_checked_in_its_own_unit(self):
        self.recorded("t,displacement", decays(), units={"displacement": "rad"})
        result = run("check", self.path)
        self.assertEqual(result.returncode, 0, result.stderr + result.stdout)


if __name__ == "__main__":
    unittest.main()
