"""An include may run only down the tables of docs/architecture.md, between rooms and inside the estimator."""
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
    "gateway": {"base", "protocol", "cli"},
    "mqtt": {"base", "protocol", "cli"},
}
EXTRA = {"drivers/sim": {"sim"}, "drivers/replay": {"record"}}
# Inner rooms of the estimator. ROOT: the files that lie in estimator/ itself.
ROOT = "estimator"
INNER_MAY_INCLUDE = {
    "math": set(),
    "signal": {"math"},
    ROOT: set(),
    "effects": {"math"},
    "formula": {"math", "effects"},
    "model": {"math", "effects", "formula"},
    "instrument": {"effects", "model"},
    "periodic": {"math", "model", "instrument"},
    "fit": {"math", ROOT, "effects", "model", "periodic"},
    "objectives": {"math", "instrument", "periodic", "fit"},
    "inference": {"math", ROOT, "periodic", "fit", "objectives"},
    "online": {"math", ROOT, "model", "periodic", "fit", "inference"},
    "design": {"math", "fit", "inference"},
    "time": {"math", ROOT, "model", "fit"},
    "estimate": {ROOT, "model", "fit", "objectives", "inference", "time"},
    "diagnosis": {"math", ROOT, "effects", "model", "instrument", "periodic", "time"},
    "paper": {"math", "model", "fit", "time"},
}
INCLUDE = re.compile(r'^\s*#\s*include\s+"([a-z_]+)/([^"]+)"')


def inner_room(path: str) -> str:
    """Of a path below estimator/."""
    return path.split("/")[0] if "/" in path else ROOT


def written(inner: str) -> str:
    return "estimator/" if inner == ROOT else f"estimator/{inner}/"


def refusal(relative: pathlib.PurePath, room: str, path: str) -> str | None:
    """Why the file `relative` may not include room/path, or None."""
    own = relative.parts[0]
    if room != own and room not in MAY_INCLUDE[own] | EXTRA.get("/".join(relative.parts[:2]), set()):
        return f"{own}/ may not include {room}/"
    if own == room == "estimator":
        here, there = inner_room("/".join(relative.parts[1:])), inner_room(path)
        if here not in INNER_MAY_INCLUDE:
            return f"{written(here)} has no row in tests/structure/check_includes.py"
        if there != here and there not in INNER_MAY_INCLUDE[here]:
            return f"{written(here)} may not include {written(there)}"
    return None


def up(table: dict[str, set[str]]) -> list[str]:
    """Why a table allows a circle: a row may name only rooms of the rows above it."""
    rooms = list(table)
    return [f"the row of {room} in check_includes.py names {other}, which is not above it"
            for index, room in enumerate(rooms) for other in sorted(table[room] - set(rooms[:index]))]


def main(root: pathlib.Path) -> int:
    wrong, seen = up(MAY_INCLUDE) + up(INNER_MAY_INCLUDE), 0
    for room in MAY_INCLUDE:
        for path in sorted((root / room).rglob("*.[ch]pp")):
            relative = path.relative_to(root)
            for number, line in enumerate(path.read_text().splitlines(), 1):
                match = INCLUDE.match(line)
                if not match:
                    continue
                seen += 1
                why = refusal(relative, *match.groups())
                if why:
                    wrong.append(f"{relative}:{number}: {why}")
    print("\n".join(wrong) or f"{seen} includes, all down the tables")
    return 1 if wrong or seen == 0 else 0


if __name__ == "__main__":
    sys.exit(main(pathlib.Path(sys.argv[1])))
