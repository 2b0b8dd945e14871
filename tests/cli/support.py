"""The real shakerctl, its output and its exit status, for the tests of this folder."""
import json
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests"))
EXAMPLES = ROOT / "config" / "examples"
DATA = ROOT / "tests" / "data"
SHAKERCTL = os.environ["SHAKERCTL"]
MAKE_CAMPAIGN = os.environ["MAKE_CAMPAIGN"]
OLEO_FEET = {"name": "oleo", "gravity": 32.2, "length_unit": "ft", "effects": [
    {"effect": "orifice_damping", "parameters": {"theta1": {"start": 5.334}}},
    {"effect": "gas_spring", "parameters": {"theta2": {"start": 5.25}, "theta3": {"start": 1.701},
                                            "theta4": {"start": 1.05}}},
    {"effect": "gravity"}]}


def run(*words, **more):
    return subprocess.run([SHAKERCTL, *map(str, words)], capture_output=True, text=True, timeout=120,
                          **more)


class Scratch(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.path = pathlib.Path(self.folder.name)
        self.model = self.write("oleo.json", json.dumps(OLEO_FEET))

    def write(self, name, text):
        path = self.path / name
        path.write_text(text, newline="")
        return path
