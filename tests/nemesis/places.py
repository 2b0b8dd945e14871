"""Where the programs and the helpers of other tests are, for those who start a script by hand."""
import os
import pathlib
import sys

SOURCE = pathlib.Path(__file__).resolve().parents[2]
BIN = SOURCE / "build" / "bin"
for variable, path in {"SHAKERD": BIN / "shakerd", "SHAKERCTL": BIN / "shakerctl",
                       "OLEOSIM": BIN / "oleosim", "SHAKER_SOURCE": SOURCE}.items():
    os.environ.setdefault(variable, str(path))
sys.path.insert(0, str(SOURCE / "tests" / "system"))
