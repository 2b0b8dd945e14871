"""shakerctl import: what other programs wrote, and what shakerctl export wrote, as a campaign's folder."""
import csv
import json
import math
import random
import struct
import subprocess
import unittest

import h5py
import numpy
import scipy.io

from support import EXAMPLES, MAKE_CAMPAIGN, Scratch, run

OLEO = EXAMPLES / "model-oleo.json"
POINTS = 32
# frequency, table's amplitude, stroke's mean, amplitude and lag
RUNS = ((1.5, 2.5, 0.15, 0.012, 0.7), (3.0, 3.0, 0.15, 0.025, 1.9))
TIMES = [i / 200 for i in range(400)]


def stroke_at(tau, row):
    return row[2] + row[3] * math.cos(2 * math.pi * tau - row[4])


def table_at(tau, row):
    return row[1] * math.cos(2 * math.pi * tau)


def columns(folder, name):
    with open(folder / f"{name}.csv", newline="") as text:
        rows = list(csv.DictReader(text))
    return {key: [float(row[key]) for row in rows] for key in rows[0]}


def mat4(**variables):
    """A MAT file of level 4: numbers as doubles, text as a matrix of character codes."""
    out = b""
    for name, value in variables.items():
        text = isinstance(value, str)
        numbers = [float(ord(c)) for c in value] if text else [float(v) for v in value]
        rows, count = (1, len(numbers)) if text else (len(numbers), 1)
        out += struct.pack("<5i", 1 if text else 0, rows, count, 0, len(name) + 1)
        out += name.encode() + b"\0" + struct.pack(f"<{len(numbers)}d", *numbers)
    return out


def matlab_class(made, name):
    """MATLAB's attribute ends with a zero that its size does not count."""
    kind = h5py.h5t.C_S1.copy()
    kind.set_size(len(name))
    kind.set_strpad(h5py.h5t.STR_NULLTERM)
    attribute = h5py.h5a.create(made.id, b"MATLAB_class", kind, h5py.h5s.create(h5py.h5s.SCALAR))
    attribute.write(numpy.array(name.encode()), mtype=kind)


def mat73(path, **structs):
    """A MAT file of version 7.3, as MATLAB lays it out: HDF5 behind 512 bytes."""
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, fields in structs.items():
            group = file.create_group(name)
            matlab_class(group, "struct")
            letters = numpy.empty(len(fields), dtype=object)
            letters[:] = [numpy.array(list(key), dtype="S1") for key in fields]
            group.attrs.create("MATLAB_fields", letters, dtype=h5py.vlen_dtype(numpy.dtype("S1")))
            for key, value in fields.items():
                if isinstance(value, str):
                    made = group.create_dataset(key, data=numpy.array([[ord(c)] for c in value], dtype="uint16"))
                    matlab_class(made, "char")
                    made.attrs["MATLAB_int_decode"] = numpy.int32(2)
                else:
                    made = group.create_dataset(key, data=numpy.array([value], dtype=float))
                    matlab_class(made, "double")
    with open(path, "r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM")


def uff58(values, quantity, label, unit, step=1 / 200, times=None, kind=4, title="A run"):
    """A data set 58 after the format's description; `times`: uneven steps."""
    lines = ["    -1", "    58", title, "NONE", "NONE", "NONE", "NONE",
             f"{1:5d}{1:10d}{1:5d}{0:10d} {'NONE':10s}{1:10d}{3:4d} {'NONE':10s}{2:10d}{3:4d}",
             f"{kind:10d}{len(values):10d}{0 if times else 1:10d}{0:13.5E}{step:13.5E}{0:13.5E}"]
    for code, name, of in ((17, "Time", "s"), (quantity, label, unit), (0, "NONE", "NONE"), (0, "NONE", "NONE")):
        lines.append(f"{code:10d}{0:5d}{0:5d}{0:5d} {name:20s} {of:20s}")
    number = "{:20.12E}" if kind == 4 else "{:13.5E}"
    cells = [number.format(v) for v in values] if times is None else \
        [f"{t:13.5E}" + number.format(v) for t, v in zip(times, values)]
    per_line = (4 if kind == 4 else 6) if times is None else (2 if kind == 4 else 3)
    lines += ["".join(cells[i:i + per_line]) for i in range(0, len(cells), per_line)]
    return "\n".join(lines + ["    -1"]) + "\n"


class Import(Scratch):
    def take(self, source, *words):
        out = self.path / "taken"
        result = run("import", source, "--out", out, *words)
        self.assertEqual(result.returncode, 0, result.stderr)
        return out, json.loads((out / "campaign.json").read_text())

    def refused(self, sentence, source, *words):
        out = self.path / "refused"
        result = run("import", source, "--out", out, *words)
        self.assertEqual(result.returncode, 2, result.stdout)
        self.assertIn(sentence, result.stderr)
        self.assertFalse((out / "campaign.json").exists())

    def assert_is_first_run(self, found, rtol=1e-12):
        numpy.testing.assert_allclose(found["t"], TIMES, rtol=rtol, atol=1e-12)
        numpy.testing.assert_allclose(found["displacement"], [stroke_at(1.5 * t, RUNS[0]) for t in TIMES], rtol=rtol)
        numpy.testing.assert_allclose(found["excitation"], [table_at(1.5 * t, RUNS[0]) for t in TIMES], rtol=rtol,
                                      atol=1e-4 if rtol > 1e-9 else 1e-12)


class Exported(Import):
    """What shakerctl export wrote comes back, and gives the estimate of its database."""

    def setUp(self):
        super().setUp()
        rows = [",".join(map(repr, (r[0], r[1], *(stroke_at(i / POINTS, r) for i in range(POINTS))))) for r in RUNS]
        made = subprocess.run([MAKE_CAMPAIGN, self.path, self.write("table.csv", "\n".join(rows) + "\n"), OLEO],
                              check=True, capture_output=True, text=True)
        self.database = made.stdout.strip()

    def test_each_format_comes_back_with_its_cycles_and_its_estimate(self):
        first = run("estimate", self.database, "--json")
        wanted = json.loads(first.stdout)
        for form, source, rtol in (("csv", "csv", 1e-12), ("mat", "mat/known_export.mat", 1e-12),
                                   ("uff", "uff/known_export.uff", 1e-9)):
            with self.subTest(form):
                at = self.path / form
                # --all: what was not accepted is left out again.
                done = run("export", self.database, "--directory", at, "--format", form,
                           *(["--all"] if form != "uff" else []))
                self.assertEqual(done.returncode, 0, done.stderr)
                out = self.path / f"from-{form}"
                done = run("import", self.path / source, "--out", out)
                self.assertEqual(done.returncode, 0, done.stderr)
                campaign = json.loads((out / "campaign.json").read_text())
                self.assertEqual(campaign["name"], "known")
                self.assertEqual(campaign["units"], {"time": "s", "displacement": "m"})
                self.assertEqual(json.loads((out / "import.json").read_text())["rig"], "none")
                for row, entry, name in zip(RUNS, campaign["runs"], ("r01", "r02"), strict=True):
                    self.assertEqual((entry["name"], entry["kind"]), (name, "periodic"))
                    self.assertAlmostEqual(entry["frequency_hz"], row[0], delta=1e-12)
                    self.assertAlmostEqual(entry["amplitude"], row[1], delta=1e-12)
                    found = columns(out, name)
                    shifts = [shift if i % 2 == 0 else 0.0 for shift in (1e-5, -1e-5, 0.0) for i in range(POINTS)]
                    numpy.testing.assert_allclose(
                        found["displacement"], [stroke_at(i / POINTS, row) + s for i, s in enumerate(shifts)], rtol=rtol)
                    numpy.testing.assert_allclose(numpy.diff(found["t"]), 1 / (POINTS * row[0]), rtol=1e-9)
                again = run("estimate", out, "--model", OLEO, "--json")
                self.assertEqual(again.returncode, first.returncode, again.stderr)
                for a, b in zip(wanted["parameters"], json.loads(again.stdout)["parameters"], strict=True):
                    self.assertAlmostEqual(a["value"], b["value"], delta=1e-6 * abs(a["value"]))

    def test_a_folder_with_files_is_not_written_into(self):
        (self.path / "mine").mkdir()
        self.write("mine/notes.txt", "mine")
        run("export", self.database, "--directory", self.path / "csv")
        result = run("import", self.path / "csv", "--out", self.path / "mine")
        self.assertEqual(result.returncode, 2)
        self.assertIn("is not empty, and nothing in it is replaced", result.stderr)
        self.assertEqual([f.name for f in (self.path / "mine").iterdir()], ["notes.txt"])

    def test_a_database_needs_no_import(self):
        self.refused("is a campaign database, which `estimate` and `diagnose` read as it is", self.database)


class Csv(Import):
    def lines(self, header, scale=1.0):
        rows = [f"{t!r},{scale * stroke_at(1.5 * t, RUNS[0])!r},{table_at(1.5 * t, RUNS[0])!r}" for t in TIMES]
        return "\n".join([header, *rows]) + "\n"

    def test_units_come_from_the_header_or_the_command_line(self):
        source = self.path / "source"
        source.mkdir()
        self.write("source/slow.csv", self.lines("time,pos [mm],shake [m/s^2]", 1000))
        names = ("--column", "t=time", "--column", "displacement=pos", "--column", "excitation=shake")
        out, campaign = self.take(source, *names, "--frequency", 1.5)
        self.assertEqual(campaign["name"], "source")
        self.assertEqual(campaign["units"], {"time": "s", "displacement": "m", "excitation": "m/s^2"})
        self.assertEqual(campaign["runs"], [{"name": "slow", "file": "slow.csv", "kind": "periodic",
                                             "frequency_hz": 1.5}])
        self.assert_is_first_run(columns(out, "slow"))
        self.assertEqual(run("diagnose", out, "--model", OLEO, "--json").returncode in (0, 5), True)

    def test_bad_input_gets_a_sentence(self):
        good = self.write("good.csv", self.lines("t,displacement [mm],excitation [g]"))
        plain = self.write("plain.csv", self.lines("t,displacement,excitation"))
        self.refused("run plain: the file states no unit of displacement; say --unit displacement=UNIT, one of "
                     "m, cm, mm, um, in, ft", plain)
        self.refused('displacement is in "furlong", which is no unit of it; known are m, cm', plain,
                     "--unit", "displacement=furlong")
        self.refused('displacement is in "mm" by the file and in "in" by --unit', good, "--unit", "displacement=in")
        self.refused("--unit stroke=mm: CHANNEL=NAME is wanted", good, "--unit", "stroke=mm")
        self.refused("--frequency has 2 numbers and there are 1 runs", good, "--frequency", "1,2")
        self.refused("there is no such file", self.path / "nothing.mat")
        self.refused("a folder of CSV files, or a file .csv, .mat, .uff or .unv is wanted", self.model)
        self.refused("the header row is", self.write("other.csv", "a,b\n1,2\n"))
        back = self.write("back.csv", "t,displacement [m]\n0,1\n0,2\n")
        self.refused("time does not increase: t = 0 is followed by 0 (value 2)", back)


class Mat(Import):
    def variables(self):
        return {"t": TIMES, "displacement": [1e3 * stroke_at(1.5 * t, RUNS[0]) for t in TIMES],
                "excitation": [table_at(1.5 * t, RUNS[0]) / 9.80665 for t in TIMES], "displacement_unit": "mm",
                "excitation_unit": "g"}

    def test_variables_of_one_run(self):
        (self.path / "drive.mat").write_bytes(mat4(**self.variables()))
        out, campaign = self.take(self.path / "drive.mat", "--frequency", 1.5)
        self.assertEqual([r["name"] for r in campaign["runs"]], ["drive"])
        self.assert_is_first_run(columns(out, "drive"))

    def test_structs_of_version_7_3(self):
        mat73(self.path / "day.mat", slow=dict(self.variables(), frequency_hz=[1.5]))
        out, campaign = self.take(self.path / "day.mat")
        self.assertEqual(campaign["runs"][0]["frequency_hz"], 1.5)
        self.assert_is_first_run(columns(out, "slow"))

    def test_another_kind_gets_a_sentence(self):
        other = self.path / "other.mat"
        other.write_bytes(mat4(weights=[1, 2, 3], bias=[4]))
        self.refused('holds no run: none of its variables (weights, bias) is "displacement", or a struct', other)
        other.write_bytes(mat4(**{**self.variables(), "t": TIMES[:-1]}))
        self.refused("displacement has 400 values and t has 399", other)
        other.write_bytes(mat4(displacement=[1.0, 2.0]))
        self.refused("has neither t nor frequency_hz", other)
        other.write_bytes(mat4(**{**self.variables(), "displacement_unit": "furlong"}))
        self.refused('displacement is in "furlong", which is no unit of it; known are m, cm, mm', other)
        other.write_bytes(mat4(t=[0.0, 1.0], displacement=[1.0, float("nan")], displacement_unit="m"))
        self.refused("value 2 of displacement is not a finite number", other)

    def test_a_damaged_file_gets_one_sentence(self):
        whole = {}
        for kind in ("4", "7.3"):
            (self.path / "whole.mat").write_bytes(mat4(**self.variables()))
            if kind == "7.3":
                mat73(self.path / "whole.mat", slow=dict(self.variables(), frequency_hz=[1.5]))
            whole[kind] = (self.path / "whole.mat").read_bytes()
        damaged = self.path / "damaged.mat"
        for rubbish in (b"", b"no MAT file " * 50, whole["4"][:3500], whole["4"][:8000], whole["4"][:-1],
                        whole["7.3"][:520], whole["7.3"][:3000], whole["7.3"][:-100]):
            damaged.write_bytes(rubbish)
            self.refused("damaged.mat: ", damaged)
            said = run("import", damaged, "--out", self.path / "refused").stderr
            self.assertEqual(said.count("\n"), 1, said)


    def test_changed_bytes_of_a_struct_never_end_the_program(self):
        few = {k: v if isinstance(v, str) else v[:60] for k, v in self.variables().items()}
        scipy.io.savemat(self.path / "whole.mat", {"slow": few})
        whole, chance = (self.path / "whole.mat").read_bytes(), random.Random(3)
        self.assertEqual(run("import", self.path / "whole.mat", "--out", self.path / "whole").returncode, 0)
        damaged = self.path / "damaged.mat"
        for number in range(80):
            data = bytearray(whole)
            for _ in range(chance.choice((1, 2, 5, 20))):
                at = chance.randrange(128, len(data) - 8)
                if chance.random() < 0.3:
                    del data[at:at + chance.randrange(1, 8)]
                else:
                    data[at] = chance.randrange(256)
            damaged.write_bytes(data)
            done = run("import", damaged, "--out", self.path / f"out{number}")
            self.assertIn(done.returncode, (0, 2), done.stderr)


class Uff(Import):
    def sets(self, kind=4, times=None):
        return (uff58([1e3 * stroke_at(1.5 * t, RUNS[0]) for t in TIMES], 8, "Position", "mm", kind=kind, times=times) +
                uff58([table_at(1.5 * t, RUNS[0]) for t in TIMES], 12, "Table", "m/s^2", kind=kind, times=times))

    def test_single_and_double_numbers_on_even_and_uneven_steps(self):
        for kind, times, rtol in ((4, None, 1e-11), (2, None, 1e-5), (4, TIMES, 1e-5), (2, TIMES, 1e-5)):
            with self.subTest(kind=kind, uneven=times is not None):
                source = self.write("a.uff", self.sets(kind, times) + uff58([1.0] * 400, 5, "Oil", "degC", title="Oil"))
                out, campaign = self.take(source, "--frequency", 1.5)
                self.assert_is_first_run(columns(out, "run1"), rtol)
                self.assertEqual(json.loads((out / "import.json").read_text())["left_out"], ["Oil"])
                for file in out.iterdir():
                    file.unlink()

    def test_a_channel_that_comes_again_begins_the_next_run(self):
        mass = uff58([0.5] * 400, 12, "Mass", "g")
        source = self.write("a.unv", self.sets() + mass + self.sets())
        out, campaign = self.take(source)
        self.assertEqual([r["name"] for r in campaign["runs"]], ["run1", "run2"])
        self.assertAlmostEqual(columns(out, "run1")["acceleration"][7], 0.5 * 9.80665, delta=1e-12)
        self.assertNotIn("acceleration", columns(out, "run2"))

    def test_bad_input_gets_a_sentence(self):
        good = self.sets()
        for text, sentence in (
                ("no such thing\n", "holds no data set 58; is this a Universal File?"),
                (good.replace("    58\n", "    58b     1     2\n", 1), "a.uff:2: the data set 58 is binary"),
                (good.replace("mm ", "ells ", 1), 'displacement is in "ells", which is no unit of it; known are m'),
                (good.replace("mm  ", "NONE", 1), "the file states no unit of displacement; say --unit"),
                ("\n".join(good.splitlines()[:40] + ["    -1"]), "the data set ends after"),
                ("\n".join(good.splitlines()[:9] + ["    -1"]), "the data set has no values"),
                (uff58([1.0, 2.0], 5, "Oil", "degC"), "holds no time response of a displacement")):
            with self.subTest(sentence):
                self.refused(sentence, self.write("a.uff", text))
        lines = good.splitlines()
        lines[20] = "               x.yz" + lines[20][19:]
        self.refused("a.uff:21: ", self.write("a.uff", "\n".join(lines)))


if __name__ == "__main__":
    unittest.main(verbosity=2)
