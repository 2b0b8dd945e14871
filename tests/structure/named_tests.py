"""The tests that a document may name."""
import pathlib
import re


def functions(path):
    return re.findall(r"def test_(\w+)", path.read_text())


class NamedTests:
    def __init__(self, root):
        tests = root / "tests"
        self.names = {f"{suite}.{name}" for path in tests.rglob("*.cpp")
                      for suite, name in re.findall(r"TEST(?:_F|_P)?\(\s*(\w+),\s*(\w+)\)", path.read_text())}
        self.names |= {f"system.{path.stem.removesuffix('_test')}.{name}"
                       for path in (tests / "system").glob("*_test.py") for name in functions(path)}
        self.names |= {f"cli.{path.stem.removeprefix('test_')}.{name}"
                       for path in (tests / "cli").glob("test_*.py") for name in functions(path)}
        for room in ("rigvm", "install"):
            declared = (tests / room / "CMakeLists.txt").read_text()
            self.names |= {f"{room}.{name}" for name in re.findall(rf"{room}_test\((\w+)", declared)}
        self.nemesis = (tests / "nemesis" / "table.py").read_text()

    def exists(self, test):
        if not test.startswith("nemesis:"):
            return test in self.names
        name = test.removeprefix("nemesis:")
        # Some rows are made for each of several threads or calls: "thread_{name}".
        stem = name.split("_")[0] + "_{"
        last = name.split("_")[-1]
        return f'"{name}"' in self.nemesis or (f'f"{stem}' in self.nemesis and f'"{last}"' in self.nemesis)
