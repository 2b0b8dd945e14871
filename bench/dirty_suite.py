#!/usr/bin/env python3
"""Runs `shakerctl diagnose` on campaigns of the dirty world and prints how often it is right.

docs/dirty_suite.md says what the campaigns hold and how to read the figures. The campaigns follow from --seed and
their place in the suite. Each campaign keeps one line of JSON; the figures are those of the lines, in the order of the
places, so that the parts of a suite give the same figures as one run.
"""
import argparse
import concurrent.futures
import json
import math
import os
import pathlib
import resource
import shutil
import subprocess
import sys
import tempfile

KINDS = ("periodic", "imposed", "sweep", "decay", "drop")
SURE = 0.9
# The effect that nearly describes an unknown: not a wrong name.
ACTS_AS = {"bearing_tilt": "pinched_friction", "appendage": "added_mass"}
LIMIT_S = 300  # of processor time of a diagnosis


def named(answer: dict) -> list[dict]:
    return [{"name": e["name"], "probability": e["probability"], "set": e["confusable_with"]}
            for e in answer["effects"]]


def diagnose(shakerctl: pathlib.Path, folder: pathlib.Path, cache: pathlib.Path) -> dict:
    """What the program answers, its processor time in seconds, or its trouble."""
    with tempfile.TemporaryFile("w+") as out, tempfile.TemporaryFile("w+") as err:
        child = subprocess.Popen([shakerctl, "diagnose", folder, "--model", folder / "model.json", "--json"], stdout=out,
                                 stderr=err, env={**os.environ, "XDG_CACHE_HOME": str(cache)})
        resource.prlimit(child.pid, resource.RLIMIT_CPU, (LIMIT_S, LIMIT_S))
        _, status, used = os.wait4(child.pid, 0)
        child.returncode = os.waitstatus_to_exitcode(status)
        out.seek(0)
        err.seek(0)
        line = {"status": child.returncode, "seconds": round(used.ru_utime + used.ru_stime, 3)}
        if child.returncode != 0:
            return line | {"verdict": "none", "names": [], "trouble": err.read().strip()[-300:]}
        answer = json.load(out)
    gap = answer["gap"]
    return line | {"verdict": answer["verdict"], "names": named(answer), "before": gap["before"], "after": gap["after"],
                   "floor": gap["noise_floor"], "expected_noise": gap["noise"], "not_tried": len(answer["not_tried"])}


def one(programs: pathlib.Path, folder: pathlib.Path, seed: int, index: int, keep: bool) -> dict:
    """Makes one campaign, has it diagnosed and returns its line."""
    subprocess.run([programs / "tests/dirty/dirty_campaigns", folder, str(seed), str(index)], check=True)
    campaign = folder / f"{index:06}"
    sealed = folder / f"{index:06}.truth.json"
    line = diagnose(programs / "bin/shakerctl", campaign, folder / "cache")
    truth = json.loads(sealed.read_text())
    if not keep:
        shutil.rmtree(campaign)
        sealed.unlink()
    effects = truth["effects"]
    largest = max(effects, key=lambda name: truth["visible"][name]) if effects else ""
    told = {key: truth[key] for key in ("index", "seed", "kind", "holds", "changes", "visible", "gap_alone", "motion", "noise")}
    return told | {"effects": sorted(effects), "unknown": "".join(truth["unknown"]), "largest": largest} | line


def share(lines: list, right) -> str:
    """How many of the lines are right: a percentage with its counts."""
    hits = sum(1 for line in lines if right(line))
    return f"{100 * hits / len(lines):.1f} % ({hits} of {len(lines)})" if lines else "-"


def first_right(line: dict) -> bool:
    return bool(line["names"]) and line["names"][0]["name"] == line["largest"]


def in_set(line: dict) -> bool:
    return any(line["largest"] in [n["name"], *n["set"]] for n in line["names"])


def is_there(name: str, line: dict) -> bool:
    return name in line["effects"] or name == ACTS_AS.get(line["unknown"])


def wrong_and_sure(line: dict) -> bool:
    return any(n["probability"] > SURE and not is_there(n["name"], line) for n in line["names"])


def expected_gap(line: dict) -> float:
    """What unknown, changes of the runs and noise leave where every effect of the catalogue is modelled."""
    return math.hypot(line["gap_alone"], line["expected_noise"])


def statements(lines: list) -> list[tuple[float, bool]]:
    """Every name that was said: its probability, and whether it is there."""
    return [(n["probability"], is_there(n["name"], line)) for line in lines for n in line["names"]]


def bins(said: list) -> list[tuple[float, list]]:
    return [(k / 10, [s for s in said if min(int(s[0] * 10), 9) == k]) for k in range(10)]


def calibration_error(said: list) -> float:
    return math.fsum(abs(math.fsum(p - right for p, right in held)) for _, held in bins(said)) / max(len(said), 1)


def calibration_error_by_chance(said: list) -> float:
    """What the calibration error of so many calibrated names is on average: the scatter of the shares of each bin."""
    scatter = (math.sqrt(2 / math.pi * math.fsum(p * (1 - p) for p, _ in held)) for _, held in bins(said))
    return math.fsum(scatter) / max(len(said), 1)


def brier(said: list) -> float:
    return math.fsum((p - right) ** 2 for p, right in said) / max(len(said), 1)


def column(lines: list) -> list[str]:
    """The figures of some lines, in the order of FIGURES."""
    hidden = [x for x in lines if x["holds"] == "effects"]
    answered = [x for x in hidden if x["verdict"] != "none"]
    nulls = [x for x in lines if x["holds"] == "nothing"]
    said = statements(lines)
    near = [s for s in said if 0.85 <= s[0] < 0.95]
    seconds = [x["seconds"] for x in lines]
    return [share(lines, lambda x: x["verdict"] != "none"),
            share(nulls, lambda x: x["verdict"] not in ("adequate", "none")),
            share(answered, lambda x: x["verdict"] != "adequate"),
            share(hidden, first_right), share(hidden, in_set), share(lines, wrong_and_sure),
            share(near, lambda s: s[1]), f"{brier(said):.3f}" if said else "-",
            f"{calibration_error(said):.3f}" if said else "-",
            f"{calibration_error_by_chance(said):.3f}" if said else "-",
            share(answered, lambda x: x["after"] <= 1.1 * expected_gap(x)),
            f"{math.fsum(seconds) / len(seconds):.2f}, {max(seconds):.2f}" if seconds else "-"]


FIGURES = (("answered at all", ""), ("nothing hidden, and something found missing", "1 %"),
           ("effects hidden, and not called adequate", ""), ("the largest missing effect named first", "90 %"),
           ("the largest named or in the set", "97 %"), ("a name that is not there at more than 0.9", "at most 1 %"),
           ("right, of names at 0.85 .. 0.95", "90 +- 3 %"), ("Brier score of the names", ""),
           ("expected calibration error", "at most 0.03"), ("the same of calibrated names, by chance", ""),
           ("gap left at most 1.1 x what the unknown makes", "all"),
           ("processor time, s: mean, slowest", ""))


def table(head: list, rows: list) -> list[str]:
    return ["| " + " | ".join(head) + " |", "|" + "---|" * len(head), *("| " + " | ".join(r) + " |" for r in rows), ""]


def by_effect(lines: list) -> list[list[str]]:
    rows = []
    for name in sorted({x["largest"] for x in lines} - {""}):
        held = [x for x in lines if x["largest"] == name]
        rows.append([f"`{name}`", share(held, first_right), share(held, in_set)])
    return rows


def wrong_names(lines: list) -> list[list[str]]:
    """The names that are not there, most frequent first."""
    wrong: dict[str, list[float]] = {}
    for line in lines:
        for n in line["names"]:
            if not is_there(n["name"], line):
                wrong.setdefault(n["name"], []).append(n["probability"])
    order = sorted(wrong.items(), key=lambda item: (-len(item[1]), item[0]))
    return [[f"`{name}`", str(len(p)), f"{math.fsum(p) / len(p):.2f}", f"{max(p):.2f}"] for name, p in order]


def report(lines: list) -> str:
    lines = sorted(lines, key=lambda x: x["index"])
    columns = [column(lines)] + [column([x for x in lines if x["kind"] == k]) for k in KINDS]
    text = table(["figure", "wanted", "found"], [[*f, columns[0][i]] for i, f in enumerate(FIGURES)])
    text += table(["figure", *KINDS], [[f[0], *(c[i] for c in columns[1:])] for i, f in enumerate(FIGURES)])
    said = statements(lines)
    text += table(["stated probability", "names", "stated on average", "right"],
                  [[f"{low:.1f} .. {low + 0.1:.1f}", str(len(held)), f"{math.fsum(p for p, _ in held) / len(held):.3f}",
                    f"{sum(right for _, right in held) / len(held):.3f}"] for low, held in bins(said) if held])
    nulls = [x for x in lines if x["holds"] == "nothing"]
    text += table(["nothing hidden; what differs from run to run", "found missing"],
                  [[c, share([x for x in nulls if x["changes"] == c], lambda x: x["verdict"] not in ("adequate", "none"))]
                   for c in ("none", "zero", "preload", "temperature")])
    text += table(["only the unknown hidden", "a name at more than 0.9", "adequate"],
                  [[u, share(held, wrong_and_sure), share(held, lambda x: x["verdict"] == "adequate")]
                   for u in sorted({x["unknown"] for x in lines if x["holds"] == "unknown"})
                   for held in [[x for x in lines if x["holds"] == "unknown" and x["unknown"] == u]]])
    text += table(["largest missing effect", "named first", "named or in the set"], by_effect(lines))
    text += table(["name that is not there", "times", "mean probability", "largest"], wrong_names(lines))
    return "\n".join(text)


def merged(files: list[str]) -> list[dict]:
    """The lines of all parts. Ends with a sentence where parts do not belong together."""
    lines = [json.loads(text) for name in files for text in pathlib.Path(name).read_text().splitlines()]
    places = sorted(line["index"] for line in lines)
    if len({line["seed"] for line in lines}) > 1:
        sys.exit("dirty_suite: the parts have different seeds; merge parts of one seed.")
    if places != list(range(len(places))):
        missing = sorted(set(range(max(places, default=0) + 1)) - set(places))
        twice = sorted({p for p in places if places.count(p) > 1})
        sys.exit(f"dirty_suite: campaigns missing: {missing[:5]}, twice: {twice[:5]}; give every part once.")
    return lines


def part(text: str) -> tuple[int, int]:
    number, _, of = text.partition("/")
    if not (number.isdigit() and of.isdigit() and 1 <= int(number) <= int(of)):
        raise argparse.ArgumentTypeError(f"{text} is no part; write 3/7 for the third of seven")
    return int(number), int(of)


def options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", type=pathlib.Path, default=pathlib.Path(__file__).resolve().parent.parent / "build")
    parser.add_argument("--count", type=int, default=50, help="campaigns of the whole suite (50)")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--shard", type=part, default=(1, 1), metavar="I/N", help="only the I-th of N parts")
    parser.add_argument("--keep", type=pathlib.Path, metavar="FILE",
                        help="a line of JSON a campaign; campaigns that it already holds are not run again")
    parser.add_argument("--merge", nargs="+", metavar="FILE", help="the tables of parts that were kept")
    parser.add_argument("--folder", type=pathlib.Path, help="keep the campaigns and their truth here")
    parser.add_argument("--threads", type=int, default=1)
    return parser.parse_args()


def run(words: argparse.Namespace, folder: pathlib.Path) -> list[dict]:
    number, of = words.shard
    done = [json.loads(t) for t in words.keep.read_text().splitlines()] if words.keep and words.keep.exists() else []
    wanted = [i for i in range(words.count) if i % of == number - 1 and i not in {x["index"] for x in done}]
    with concurrent.futures.ThreadPoolExecutor(words.threads) as pool:
        futures = [pool.submit(one, words.build, folder, words.seed, i, bool(words.folder)) for i in wanted]
        for future in concurrent.futures.as_completed(futures):
            done.append(future.result())
            if words.keep:
                with words.keep.open("a") as kept:
                    kept.write(json.dumps(done[-1]) + "\n")
            names = " ".join(f"{n['name']} ({n['probability']:.3f})" for n in done[-1]["names"])
            print(f"{done[-1]['index']} {done[-1]['kind']}: {' '.join(done[-1]['effects'])} + {done[-1]['unknown']}: "
                  f"{done[-1]['verdict']} {names}", file=sys.stderr)
    return done


def main() -> int:
    words = options()
    if words.merge:
        print(report(merged(words.merge)))
        return 0
    for program in ("tests/dirty/dirty_campaigns", "bin/shakerctl", "bin/shakerctl-diagnosis"):
        if not (words.build / program).exists():
            sys.exit(f"dirty_suite: {words.build / program} is missing; build it with ninja, or give --build.")
    if words.folder:
        words.folder.mkdir(parents=True, exist_ok=True)
        lines = run(words, words.folder)
    else:
        with tempfile.TemporaryDirectory() as folder:
            lines = run(words, pathlib.Path(folder))
    if words.shard == (1, 1):
        print(report(lines))
    return 0


if __name__ == "__main__":
    sys.exit(main())
