#!/usr/bin/python3
"""Runs the libFuzzer targets one after the other, keeps their corpora, and counts the time: README.md."""
import argparse
import datetime
import json
import os
import pathlib
import re
import resource
import shutil
import subprocess
import sys
import tempfile
import time
import zipfile

HERE = pathlib.Path(__file__).resolve().parent
SOURCE = HERE.parents[1]
CORPORA = HERE / "corpus"  # NAME.zip, minimised
PAGE = SOURCE / "docs" / "soak" / "fuzz.jsonl"
MOST_OCTETS = 500_000  # of one corpus: ten of them are below 5 MB
LARGE = {"record": 65536, "candump_log": 16384, "documents": 16384}
MORE = {"formula": ["-detect_leaks=0"]}  # libcln, below GiNaC, keeps a block of a few bytes, and at the end too:
LEAKS = f"suppressions={SOURCE / 'tests' / 'leaks.supp'}:print_suppressions=0"


def targets():
    """{name: the files it starts from}, as CMakeLists.txt declares them."""
    text = (HERE / "CMakeLists.txt").read_text()
    places = {"${CMAKE_SOURCE_DIR}": SOURCE, "${CMAKE_CURRENT_SOURCE_DIR}": HERE, "${seeds}": HERE / "seeds"}
    found = {}
    for name, seeds in re.findall(r"^shaker_fuzz\((\w+) .*?SEEDS\s+([^)]*)\)", text, re.DOTALL | re.MULTILINE):
        for place, path in places.items():
            seeds = seeds.replace(place, str(path))
        found[name] = [file for word in seeds.split() for file in
                       (sorted((SOURCE / "config/examples").glob("*.json")) if word == "${examples}"
                        else [pathlib.Path(word)])]
    return found


def clang(name):
    return shutil.which(name) or f"{name}-14"


def configure(build):
    if not (build / "build.ninja").exists():
        subprocess.run(["cmake", "-S", SOURCE, "-B", build, "-G", "Ninja", f"-DCMAKE_CXX_COMPILER={clang('clang++')}",
                        f"-DCMAKE_C_COMPILER={clang('clang')}", "-DSHAKER_FUZZ=ON", "-DSHAKER_BENCH=OFF"],
                       check=True, stdout=subprocess.DEVNULL)


def make(build, names):
    configure(build)
    if subprocess.run(["ninja", "-C", build, *(f"fuzz_{name}" for name in names)],
                      stdout=subprocess.DEVNULL, check=False).returncode != 0:
        sys.exit("the targets cannot be built")


def processor_time():
    """s of the programs that have ended: a target that waited for a core has tried nothing meanwhile."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


class Target:
    def __init__(self, name, seeds, build):
        self.name, self.seeds = name, seeds
        self.program = build / "tests" / "fuzz" / f"fuzz_{name}"
        self.folder = build / "corpus" / name  # grows; the archive is what is least of it
        self.archive = CORPORA / f"{name}.zip"
        self.findings = build / "findings"
        self.options = [f"-max_len={LARGE.get(name, 4096)}", *MORE.get(name, ())]

    def prepare(self):
        self.folder.mkdir(parents=True, exist_ok=True)
        self.findings.mkdir(exist_ok=True)
        for seed in self.seeds:
            shutil.copy(seed, self.folder)
        if self.archive.exists():
            with zipfile.ZipFile(self.archive) as kept:
                kept.extractall(self.folder)

    def run(self, seconds):
        """(processor's seconds, inputs tried, findings): a finding ends this target's turn."""
        log = self.findings / f"{self.name}.log"
        began = processor_time()
        with open(log, "w") as out:
            status = subprocess.run(
                [self.program, f"-max_total_time={seconds}", "-print_final_stats=1", "-timeout=20",
                 "-rss_limit_mb=2048", f"-artifact_prefix={self.findings / self.name}-", *self.options, self.folder],
                stdout=out, stderr=out, cwd=self.findings, check=False).returncode
        tried = re.search(r"stat::number_of_executed_units: (\d+)", log.read_text(errors="replace"))
        return round(processor_time() - began), int(tried[1]) if tried else 0, int(status != 0)

    def last_words(self):
        return (self.findings / f"{self.name}.log").read_text(errors="replace")[-4000:]

    def minimise(self):
        """The smallest corpus that reaches as much, into the archive: (files, octets)."""
        with tempfile.TemporaryDirectory(dir=self.folder.parent) as folder:
            subprocess.run([self.program, "-merge=1", *self.options, folder, self.folder], cwd=self.findings,
                           stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, check=False)
            files = sorted(pathlib.Path(folder).iterdir(), key=lambda f: (f.stat().st_size, f.name))
            CORPORA.mkdir(exist_ok=True)
            with zipfile.ZipFile(self.archive, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as kept:
                count = 0
                for file in files:
                    info = zipfile.ZipInfo(file.name)  # of a fixed day: the same files are the same archive
                    kept.writestr(info, file.read_bytes(), zipfile.ZIP_DEFLATED)
                    count += 1
                    if kept.fp.tell() > MOST_OCTETS:
                        break
            return count, self.archive.stat().st_size


def keep(line):
    with open(PAGE, "a", encoding="utf-8") as out:
        out.write(json.dumps({"day": datetime.date.today().isoformat(), **line}) + "\n")


def sums():
    found = {}
    for text in PAGE.read_text().splitlines() if PAGE.exists() else []:
        line = json.loads(text)
        row = found.setdefault(line["target"], [0, 0, 0])
        for i, key in enumerate(("seconds", "inputs", "findings")):
            row[i] += line[key]
    print(f"{'target':16}{'hours':>8}{'million inputs':>16}{'findings':>10}")
    for name, row in {**found, "all": [sum(row[i] for row in found.values()) for i in range(3)]}.items():
        print(f"{name:16}{row[0] / 3600:8.2f}{row[1] / 1e6:16.1f}{row[2]:10}")


def main():
    parse = argparse.ArgumentParser(description=__doc__)
    parse.add_argument("--build", type=pathlib.Path, default=SOURCE / "build-fuzz")
    parse.add_argument("--as-built", action="store_true", help="build nothing")
    parse.add_argument("--minutes", type=float, default=10, help="of all targets together")
    parse.add_argument("--turn", type=int, default=120, help="s that a target runs before the next one does")
    parse.add_argument("--only", action="append", choices=sorted(targets()), metavar="TARGET")
    parse.add_argument("--keep", action="store_true", help="add to docs/soak, and renew tests/fuzz/corpus")
    parse.add_argument("--sums", action="store_true", help="what docs/soak holds, and no run")
    options = parse.parse_args()
    if options.sums:
        return sums()
    build = options.build.resolve()
    names = options.only or sorted(targets())
    if not options.as_built:
        make(build, names)
    os.environ["ASAN_OPTIONS"] = "allocator_may_return_null=1"
    os.environ["LSAN_OPTIONS"] = LEAKS
    waiting = [Target(name, targets()[name], build) for name in names]
    for target in waiting:
        target.prepare()
    found, end = 0, time.monotonic() + 60 * options.minutes
    turn = min(options.turn, max(1, int(60 * options.minutes / len(waiting))))
    while time.monotonic() < end - 1:
        target = waiting.pop(0)
        waiting.append(target)
        seconds, inputs, findings = target.run(min(turn, max(1, int(end - time.monotonic()))))
        found += findings
        print(f"{target.name}: {seconds} s, {inputs} inputs, {findings} findings"
              + (f": see {target.findings}\n{target.last_words()}" if findings else ""), flush=True)
        if options.keep:
            keep({"target": target.name, "seconds": seconds, "inputs": inputs, "findings": findings})
    if options.keep:
        for target in waiting:
            count, octets = target.minimise()
            print(f"{target.name}: {count} files, {octets} octets in {target.archive.name}")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
