"""shakerctl export as MAT and UFF, read back by h5py and by a reader of its own."""
import cmath
import json
import math
import pathlib
import subprocess
import unittest

import h5py
import numpy

from support import MAKE_CAMPAIGN, ROOT, Scratch, run
from test_diagnose import MODEL, response, stroke as stroke_at

POINTS = 16
# frequency, table's amplitude, stroke's mean, amplitude and lag: the closed form of what is in the file.
RUNS = ((1.5, 2.5, 0.15, 0.012, 0.7), (3.0, 3.0, 0.15, 0.025, 1.9))


def stroke(run):
    _, _, mean, amplitude, lag = run
    return [mean + amplitude * math.cos(2 * math.pi * i / POINTS - lag) for i in range(POINTS)]


def wanted_cycles(run):
    """make_campaign's three accepted cycles: the table's, every other point moved."""
    return [[u + (shift if i % 2 == 0 else 0.0) for i, u in enumerate(stroke(run))] for shift in (1e-5, -1e-5, 0.0)]


def data_sets(text):
    """Data sets 58 of a universal file: (header lines, records 6 to 11, numbers as words)."""
    lines = text.splitlines()
    at, found = 0, []
    while at < len(lines):
        assert lines[at] == "    -1" and lines[at + 1] == "    58", lines[at:at + 2]
        end = lines.index("    -1", at + 2)
        body = lines[at + 2:end]
        assert all(len(line) <= 80 for line in body), max(body, key=len)
        found.append((body[:5], body[5:11], [line[i:i + 20] for line in body[11:]
                                             for i in range(0, len(line), 20)], body[11:]))
        at = end + 1
    return found


class Export(Scratch):
    def setUp(self):
        super().setUp()
        rows = [",".join(map(repr, (r[0], r[1], *stroke(r)))) for r in RUNS]
        made = subprocess.run([MAKE_CAMPAIGN, str(self.path), str(self.write("table.csv", "\n".join(rows) + "\n")),
                               str(ROOT / "config/examples/model-oleo.json")], check=True, capture_output=True, text=True)
        self.database = made.stdout.strip()

    def export(self, *words):
        result = run("export", self.database, "--directory", self.path, "--json", *words)
        self.assertEqual(result.returncode, 0, result.stderr)
        return [pathlib.Path(file["file"]) for file in json.loads(result.stdout)["files"]]

    def test_a_mat_file_holds_what_was_measured(self):
        [file] = self.export("--format", "mat", "--samples")
        with h5py.File(file) as mat:
            text = lambda at: bytes(numpy.ravel(mat[at][()]).astype("uint8")).decode()
            self.assertEqual(text("campaign/status"), "success")
            self.assertEqual(json.loads(text("campaign/model_json"))["name"], "oleo")
            for index, row in enumerate(RUNS):
                at = f"run{index + 1}"
                self.assertEqual(mat[f"{at}/frequency_hz"][0, 0], row[0])
                self.assertEqual(text(f"{at}/displacement_unit"), "m")
                # HDF5 has MATLAB's columns as rows.
                numpy.testing.assert_array_equal(mat[f"{at}/displacement"], wanted_cycles(row))
                self.assertEqual(mat[f"{at}/accepted"].shape[1], 3)
                samples = mat[f"{at}/samples/displacement"]
                self.assertEqual(text(f"{at}/samples/displacement/unit"), "m")
                self.assertEqual(samples["t"].shape, samples["value"].shape)
                self.assertGreater(samples["value"].shape[1], 0)

    def test_a_universal_file_holds_cycles_and_the_response(self):
        [file] = self.export("--format", "uff")
        sets = data_sets(file.read_text())
        series = [s for s in sets if s[1][0].split()[0] == "1" and " Stroke" in s[0][0]]
        self.assertEqual(len(series), len(RUNS))
        for row, (header, records, words, _) in zip(RUNS, series):
            kind, count, even = records[1][:10], records[1][10:20], records[1][20:30]
            self.assertEqual((int(kind), int(count), int(even)), (4, 3 * POINTS, 1))
            self.assertAlmostEqual(float(records[1][43:56]), 1 / (POINTS * row[0]), places=6)
            self.assertEqual(records[2].split(), ["17", "0", "0", "0", "Time", "s"])
            self.assertEqual(records[3].split(), ["8", "0", "0", "0", "Stroke", "m"])
            wanted = [u for cycle in wanted_cycles(row) for u in cycle]
            numpy.testing.assert_allclose([float(w) for w in words], wanted, rtol=1e-11)
        [(_, records, _, lines)] = [s for s in sets if s[1][0].split()[0] == "4"]
        self.assertEqual(int(records[1][:10]), 6)
        self.assertEqual(int(records[1][20:30]), 0)
        for row, line in zip(RUNS, lines):
            self.assertAlmostEqual(float(line[:13]), row[0], places=4)
            found = complex(float(line[13:33]), float(line[33:53]))
            self.assertLess(abs(found - row[3] / row[1] * cmath.exp(-1j * row[4])), 1e-9)

    def test_a_csv_file_has_its_units_beside_it(self):
        self.export()
        [beside] = self.path.glob("*_export.json")
        told = json.loads(beside.read_text())
        self.assertEqual(told["units"]["displacement"], "m")
        self.assertEqual(told["model"]["name"], "oleo")
        self.assertRegex(told["started_utc"], r"^\d{4}-\d{2}-\d{2}T")
        for each in told["runs"]:
            self.assertTrue((self.path / each["file"]).is_file())

    def test_what_cannot_be_written_is_said_and_leaves_nothing(self):
        for kind in ("mat", "uff", "csv"):
            result = run("export", self.database, "--directory", "/proc/nowhere", "--format", kind)
            self.assertEqual(result.returncode, 2)
            self.assertIn("cannot be written", result.stderr)
        self.assertEqual(run("export", self.database, "--format", "xls").returncode, 2)
        self.assertEqual(list(self.path.glob("*.part")), [])


class Folder(Scratch):
    """A folder in mm with closed-form responses, whose strokes have a noise of 1e-5 m."""
    FREQUENCIES = (0.8, 1.3, 2.1)

    def setUp(self):
        super().setUp()
        self.campaign = self.path / "campaign"
        self.campaign.mkdir()
        runs = []
        for i, frequency in enumerate(self.FREQUENCIES, 1):
            head, *rows = response(frequency).splitlines()
            cells = [row.split(",") for row in rows]
            (self.campaign / f"r{i}.csv").write_text(
                head + "\n" + "".join(f"{t},{x},{float(u) * 1e3!r}\n" for t, x, u in cells))
            runs.append({"name": f"r{i}", "frequency_hz": frequency, "amplitude": 2.0})
        (self.campaign / "campaign.json").write_text(json.dumps(
            {"format": "shaker-campaign/1", "units": {"displacement": "mm"}, "runs": runs}))
        self.out = self.path / "out"

    def export(self, *words):
        result = run("export", self.campaign, "--directory", self.out, "--json", *words)
        self.assertEqual(result.returncode, 0, result.stderr)
        return json.loads(result.stdout)

    def test_its_steady_cycles_are_those_of_the_closed_form(self):
        said = self.export("--format", "mat")
        self.assertEqual(said["campaign"], "campaign")
        with h5py.File(said["files"][0]["file"]) as mat:
            for i, frequency in enumerate(self.FREQUENCIES, 1):
                cycles = numpy.array(mat[f"run{i}/displacement"])
                self.assertGreater(len(cycles), 5)
                points = cycles.shape[1]
                wanted = [stroke_at(frequency, k / points / frequency) for k in range(points)]
                numpy.testing.assert_allclose(cycles, numpy.tile(wanted, (len(cycles), 1)), atol=2e-5)
                self.assertAlmostEqual(mat[f"run{i}/cycle_amplitude"][0, 0], 2.0, delta=1e-6)

    def test_it_comes_back_with_its_estimate(self):
        self.export()
        model = self.write("linear.json", json.dumps(MODEL))
        back = self.path / "back"
        self.assertEqual(run("import", self.out, "--out", back).returncode, 0)
        estimate = json.loads(run("estimate", back, "--model", model, "--json").stdout)
        found = {p["name"]: p["value"] for p in estimate["parameters"]}
        self.assertAlmostEqual(found["c"], 2.0, delta=2e-3)
        self.assertAlmostEqual(found["k"], 100.0, delta=2e-2)

    def test_its_samples_are_those_of_its_files_in_metres(self):
        said = self.export("--samples")
        rows = (self.campaign / "r1.csv").read_text().splitlines()[1:]
        self.assertEqual(said["files"][0]["samples"], 2 * len(rows))
        found = [line.split(",") for line in pathlib.Path(said["files"][0]["file"]).read_text().splitlines()[1:]]
        strokes = [float(value) for _, channel, value, quality, unit in found
                   if (channel, quality, unit) == ("displacement", "good", "m")]
        numpy.testing.assert_allclose(strokes, [1e-3 * float(row.split(",")[2]) for row in rows], rtol=1e-12)

    def test_what_a_folder_has_not_is_told(self):
        result = run("export", self.campaign, "--directory", self.out, "--all")
        self.assertEqual(result.returncode, 2)
        self.assertIn("leave --all out", result.stderr)
        (self.campaign / "campaign.json").write_text(json.dumps(
            {"format": "shaker-campaign/1", "runs": [{"name": "r1", "kind": "transient"}]}))
        result = run("export", self.campaign, "--directory", self.out)
        self.assertEqual(result.returncode, 2)
        self.assertIn("export its --samples", result.stderr)


if __name__ == "__main__":
    unittest.main(verbosity=2)
