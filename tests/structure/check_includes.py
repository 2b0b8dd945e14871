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
# Inner rooms of the estimator. ROOT: the files that lie in estimator/ itself, its face. A name in a row stands for
# the room and all its folders; a folder with a row of its own is a room inside a room.
ROOT = "estimator"
INNER_MAY_INCLUDE = {
    "math": set(),
    "signal": {"math"},
    "model/effects": {"math"},
    "model/formula": {"math", "model/effects"},
    "model": {"math", "model/effects", "model/formula"},
    "model/instrument": {"model"},
    "solve/periodic": {"math", "model"},
    "solve/time": {"math", "model"},
    "fit": {"math", "model", "solve"},
    "fit/objectives": {"math", "model", "solve", "fit"},
    "fit/records": {"math", "model", "solve", "fit"},
    "inference": {"math", "solve", "fit"},
    "online": {"math", "model", "solve", "fit", "inference"},
    "design": {"math", "fit"},
    "drop": {"math", "model", "solve", "fit"},
    ROOT: {"model", "fit", "inference"},
    "diagnosis": {"math", "signal", "model", "solve", "fit"},
    "paper": {"math", "model", "solve", "fit"},
}
# Folders of a room from the ground up: they share its internal headers, and include only folders before them. A file
# beside them is either shared by all or calls them: it may include any.
FOLDERS = {"diagnosis": ("cycles", "records", "fit", "score", "noise", "select", "force", "report")}
INCLUDE = re.compile(r'^\s*#\s*include\s+"([a-z_]+)/([^"]+)"')


def covers(name: str, inner: str) -> bool:
    return inner == name or inner.startswith(f"{name}/")


def inner_room(path: str) -> str:
    """Of a path below estimator/: the innermost folder with a row; where none has one, the outermost folder."""
    folder = path.rpartition("/")[0]
    if not folder:
        return ROOT
    found = [name for name in INNER_MAY_INCLUDE if covers(name, folder)]
    return max(found, key=len, default=folder.split("/")[0])


def written(inner: str) -> str:
    return "estimator/" if inner == ROOT else f"estimator/{inner}/"


def folders_up(here: str, there: str) -> str | None:
    """Why a file of the folder `here` of a room may not include one of `there`, or None: both below estimator/."""
    for room, order in FOLDERS.items():
        if not (covers(room, here) and covers(room, there)):
            continue
        own, other = ((name.split("/") + [""])[1] for name in (here, there))
        if own in order and other in order and order.index(other) > order.index(own):
            return f"{written(f'{room}/{own}')} may not include {written(f'{room}/{other}')}"
    return None


def refusal(relative: pathlib.PurePath, room: str, path: str) -> str | None:
    """Why the file `relative` may not include room/path, or None."""
    own = relative.parts[0]
    if room != own and room not in MAY_INCLUDE[own] | EXTRA.get("/".join(relative.parts[:2]), set()):
        return f"{own}/ may not include {room}/"
    inside = own == room == "estimator"
    if "internal" in path.split("/") and not (inside and inner_room("/".join(relative.parts[1:])) == inner_room(path)):
        return f"{room}/{path} is internal to its room"
    if inside:
        here, there = inner_room("/".join(relative.parts[1:])), inner_room(path)
        if here not in INNER_MAY_INCLUDE:
            return f"{written(here)} has no row in tests/structure/check_includes.py"
        if there != here and not any(covers(name, there) for name in INNER_MAY_INCLUDE[here]):
            return f"{written(here)} may not include {written(there)}"
        return folders_up("/".join(relative.parts[1:-1]), path.rpartition("/")[0])
    return None


def up(table: dict[str, set[str]]) -> list[str]:
    """Why a table allows a circle: a row may name only rooms of the rows above it."""
    rooms = list(table)
    return [f"the row of {room} in check_includes.py names {other}, which is not above it"
            for index, room in enumerate(rooms) for other in sorted(table[room])
            if not any(covers(other, above) for above in rooms[:index])]


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
