"""A run that cannot be used is left out with a warning, and the rest goes on: the linear oscillator in closed form."""
import json
import os
import unittest

from support import Scratch, run
from test_diagnose import MODEL, response
from test_estimate_records import decays, written

TRUTH = {"c": 2.0, "k": 100.0}
CLIPPED, SHORT = "run clipped: the displacement stays on its highest value: the sensor is clipped", "run short: "


def clipped(table, column):
    """The table with all that is above half of the column's largest value cut off."""
    head, *rows = table.splitlines()
    rows = [row.split(",") for row in rows]
    most = 0.5 * max(float(row[column]) for row in rows)
    for row in rows:
        row[column] = repr(min(float(row[column]), most))
    return "\n".join([head, *(",".join(row) for row in rows)]) + "\n"


def first(table, lines):
    return "\n".join(table.splitlines()[:lines + 1]) + "\n"


class LeftOut(Scratch):
    def recorded(self, tables, **said):
        runs = []
        for name, (table, more) in tables.items():
            self.write(f"{name}.csv", table)
            runs.append({"name": name, **more, **said})
        self.write("campaign.json", json.dumps({"format": "shaker-campaign/1", "runs": runs}))

    def call(self, command, *words):
        result = run(command, self.path, "--model", self.model, *words,
                     env={**os.environ, "XDG_CACHE_HOME": str(self.path / "cache")})
        self.assertEqual(result.returncode, 0, result.stderr + result.stdout)
        return result

    def periodic(self):
        tables = {f"r{i}": (response(f), {"frequency_hz": f, "amplitude": 2.0})
                  for i, f in enumerate((0.8, 1.3, 2.1))}
        tables["clipped"] = (clipped(response(1.7), 2), {"frequency_hz": 1.7, "amplitude": 2.0})
        tables["short"] = (first(response(1.1), 12), {"frequency_hz": 1.1, "amplitude": 2.0})
        self.recorded(tables)
        self.model = self.write("model.json", json.dumps(MODEL))

    def free_decays(self):
        tables = {f"r{i}": ("t,displacement\n" + written(rows), said)
                  for i, (said, rows) in enumerate(decays())}
        tables["clipped"] = (clipped(tables["r0"][0], 1), {"kind": "transient"})
        tables["short"] = (first(tables["r1"][0], 12), {"kind": "transient"})
        self.recorded(tables)
        self.model = self.write("model.json", json.dumps({"name": "linear", "effects": [
            {"effect": "linear_stiffness", "parameters": {"k": {"start": 40}}},
            {"effect": "viscous_damping", "parameters": {"c": {"start": 2}}}]}))

    def told(self, warnings):
        for why in (CLIPPED, SHORT):
            self.assertTrue(any(why in w and w.endswith("(this run is left out)") for w in warnings), warnings)

    def test_an_estimate_goes_on(self):
        self.periodic()
        document = json.loads(self.call("estimate", "--json").stdout)
        self.told(document["warnings"])
        for entry in document["parameters"]:
            self.assertLess(abs(entry["value"] - TRUTH[entry["name"]]), 1e-3 * TRUTH[entry["name"]], entry)

    def test_a_diagnosis_goes_on(self):
        self.periodic()
        document = json.loads(self.call("diagnose", "--json").stdout)
        self.told(document["warnings"])
        self.assertEqual(document["verdict"], "adequate")
        self.assertEqual([r["name"] for r in document["runs"]], ["r0", "r1", "r2"])

    def test_a_drop_goes_on(self):
        self.periodic()
        document = json.loads(self.call("drop", "--sink-speed", "1", "--json").stdout)
        self.told(document["warnings"])

    def test_a_report_goes_on(self):
        self.periodic()
        self.call("report", "--out", self.path / "report.html")
        page = (self.path / "report.html").read_text()
        self.assertIn(CLIPPED, page)
        self.assertIn(SHORT, page)

    def test_records_without_a_period_go_on(self):
        self.free_decays()
        for command in ("estimate", "diagnose"):
            document = json.loads(self.call(command, "--json").stdout)
            self.told(document["warnings"])

    def test_nothing_is_said_where_no_run_is_left(self):
        self.recorded({"clipped": (clipped(response(1.7), 2), {"frequency_hz": 1.7, "amplitude": 2.0})})
        self.model = self.write("model.json", json.dumps(MODEL))
        for command, status in (("estimate", 2), ("diagnose", 5)):
            result = run(command, self.path, "--model", self.model)
            self.assertEqual(result.returncode, status, result.stderr)
            self.assertIn("no run can be used: " + CLIPPED, result.stderr)


if __name__ == "__main__":
    unittest.main()
