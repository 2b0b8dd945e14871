"""Every friction of docs/operator_day.md has tests that exist."""
import pathlib
import re
import sys

from named_tests import NamedTests

root = pathlib.Path(sys.argv[1])
named = NamedTests(root)
text = (root / "docs" / "operator_day.md").read_text()
rows = re.findall(r"^(\d+)\. \*\*(.+?)\*\*(.*?)(?=^\d+\. |\Z)", text, re.MULTILINE | re.DOTALL)
wrong = [] if [int(number) for number, _, _ in rows] == list(range(1, 26)) else ["the frictions are not 1 to 25"]
for number, _, rest in rows:
    tests = re.findall(r"`([^`]+)`", rest)
    if not tests:
        wrong.append(f"{number}: no test")
    wrong += [f"there is no test {test} ({number})" for test in tests if not named.exists(test)]
print("\n".join(wrong) or f"{len(rows)} frictions, each with tests that exist")
sys.exit(1 if wrong else 0)
