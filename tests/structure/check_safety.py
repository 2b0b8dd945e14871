"""docs/hazards.md names tests that exist, docs/safety.md bounds that are the rig file's defaults."""
import pathlib
import re
import sys

root = pathlib.Path(sys.argv[1])
text = (root / "docs" / "safety.md").read_text()
sources = {path: path.read_text() for path in (root / "tests").rglob("*.cpp")}
gtests = {f"{suite}.{name}" for body in sources.values()
          for suite, name in re.findall(r"TEST(?:_F|_P)?\(\s*(\w+),\s*(\w+)\)", body)}
system = {f"system.{path.stem.removesuffix('_test')}.{name}"
          for path in (root / "tests" / "system").glob("*_test.py")
          for name in re.findall(r"def test_(\w+)", path.read_text())}
rigvm = set(re.findall(r"rigvm_test\((\w+)", (root / "tests" / "rigvm" / "CMakeLists.txt").read_text()))
nemesis = (root / "tests" / "nemesis" / "table.py").read_text()


def exists(test):
    if test.startswith("nemesis:"):
        name = test.removeprefix("nemesis:")
        # Some rows are made for each of several threads or calls: "thread_{name}".
        stem = name.split("_")[0] + "_{"
        last = name.split("_")[-1]
        return f'"{name}"' in nemesis or (f'f"{stem}' in nemesis and f'"{last}"' in nemesis)
    if test.startswith("rigvm."):
        return test.removeprefix("rigvm.") in rigvm
    return test in gtests or test in system


hazards = (root / "docs" / "hazards.md").read_text()
items = re.findall(r"^- \*\*(.+?)\*\*(.*?)(?=^- |^#|\Z)", hazards, re.MULTILINE | re.DOTALL)
wrong = [] if len(items) > 20 else ["the list of hazards has gone"]
for hazard, rest in items:
    tests = re.findall(r"`([^`]+)`", re.split(r"\bTests?:", rest)[-1]) if re.search(r"\bTests?:", rest) else []
    if not tests:
        wrong.append(f"no test: {hazard}")
    wrong += [f"there is no test {test} ({hazard})" for test in tests if not exists(test)]

header = (root / "config" / "rig.hpp").read_text()
for key, value in re.findall(r"`(\w+_s)`, ([\d.]+) s", text + hazards):
    if not re.search(rf"\b{key} = {float(value)}\b", header):
        wrong.append(f"{key} is not {value} s in config/rig.hpp")
print("\n".join(wrong) or f"{len(items)} hazards, each with tests that exist")
sys.exit(1 if wrong else 0)
