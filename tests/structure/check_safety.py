"""docs/hazards.md names tests that exist, docs/safety.md bounds that are the rig file's defaults."""
import pathlib
import re
import sys

from named_tests import NamedTests

root = pathlib.Path(sys.argv[1])
text = (root / "docs" / "safety.md").read_text()
named = NamedTests(root)
hazards = (root / "docs" / "hazards.md").read_text()
items = re.findall(r"^- \*\*(.+?)\*\*(.*?)(?=^- |^#|\Z)", hazards, re.MULTILINE | re.DOTALL)
wrong = [] if len(items) > 20 else ["the list of hazards has gone"]
for hazard, rest in items:
    tests = re.findall(r"`([^`]+)`", re.split(r"\bTests?:", rest)[-1]) if re.search(r"\bTests?:", rest) else []
    if not tests:
        wrong.append(f"no test: {hazard}")
    wrong += [f"there is no test {test} ({hazard})" for test in tests if not named.exists(test)]

header = (root / "config" / "rig.hpp").read_text()
for key, value in re.findall(r"`(\w+_s)`, ([\d.]+) s", text + hazards):
    if not re.search(rf"\b{key} = {float(value)}\b", header):
        wrong.append(f"{key} is not {value} s in config/rig.hpp")
print("\n".join(wrong) or f"{len(items)} hazards, each with tests that exist")
sys.exit(1 if wrong else 0)
