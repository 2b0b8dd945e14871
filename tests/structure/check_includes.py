"""An include may run only down the table of docs/architecture.md."""
import pathlib
import re
import sys

MAY_INCLUDE = {
    "base": set(),
    "protocol": {"base"},
    "config": {"base", "protocol"},
    "record": {"base", "protocol"},
    "drivers": {"base", "protocol", "config"},
    "estimator": {"base", "config"},
    "report": {"base", "protocol", "config", "estimator"},
    "sim": {"base", "protocol"},
    "daemon": {"base", "protocol", "config", "record", "drivers", "estimator", "report"},
    "cli": {"base", "protocol", "config", "record", "estimator", "report"},
}
EXTRA = {"drivers/sim": {"sim"}, "drivers/replay": {"record"}}
INCLUDE = re.compile(r'^\s*#\s*include\s+"([a-z_]+)/')


def main(root: pathlib.Path) -> int:
    wrong, seen = [], 0
    for room, allowed in MAY_INCLUDE.items():
        for path in sorted((root / room).rglob("*.[ch]pp")):
            relative = path.relative_to(root)
            extra = EXTRA.get("/".join(relative.parts[:2]), set())
            for number, line in enumerate(path.read_text().splitlines(), 1):
                match = INCLUDE.match(line)
                if not match:
                    continue
                seen += 1
                target = match.group(1)
                if target != room and target not in allowed | extra:
                    wrong.append(f"{relative}:{number}: {room}/ may not include {target}/")
    print("\n".join(wrong) or f"{seen} includes, all down the table")
    return 1 if wrong or seen == 0 else 0


if __name__ == "__main__":
    sys.exit(main(pathlib.Path(sys.argv[1])))
