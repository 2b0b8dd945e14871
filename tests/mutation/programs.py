"""The test programs of each room: copied away from the build, and run until one of their tests fails."""
import contextlib
import hashlib
import os
import pathlib
import re
import shutil
import signal
import subprocess
import tempfile
import time
from dataclasses import dataclass, field

PARTS = 4  # of a program, side by side: most tests wait more than they work


@dataclass
class Room:
    """Test programs in the build folder that need neither root nor a wire, the quickest first."""
    programs: dict  # folder of the sources that it is mostly about: program

    @property
    def targets(self):
        return [pathlib.Path(program).name for program in self.programs.values()]


ROOMS = {
    "protocol": Room({"protocol": "tests/protocol/test_protocol"}),
    "config": Room({"config": "tests/config/test_config"}),
    "record": Room({"record": "tests/record/test_record", "": "tests/record/test_record_torture"}),
    "drivers": Room({"drivers/replay": "tests/replay/test_replay", "drivers": "tests/drivers/test_drivers"}),
    "daemon": Room({"daemon/service": "tests/daemon/service/test_service",
                    "daemon/publish": "tests/daemon/publish/test_publish",
                    "daemon/workers": "tests/daemon/workers/test_workers",
                    "daemon": "tests/daemon/test_daemon"}),
}

# In none of these programs: tested in a kernel that has CAN interfaces (tests/rigvm), or as a program by a script.
ELSEWHERE = {f"drivers/can/{name}.cpp" for name in ("can_exciter", "can_link", "can_sensor", "can_socket",
                                                    "dead_man")} | {"drivers/stop_main.cpp", "daemon/main.cpp"}


@dataclass
class Copies:
    folder: pathlib.Path
    build: pathlib.Path
    programs: list = field(default_factory=list)  # in the order in which they are run


class Programs:
    """What the build made, and which of it a mutation changes."""

    def __init__(self, build, folder):
        self.build, self.folder, self.digests = build, folder, {}
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir(parents=True)

    def digest(self, program):
        with open(self.build / program, "rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest() if hasattr(hashlib, "file_digest") else (
                hashlib.sha256(file.read()).hexdigest())

    def remember(self, room):
        for program in ROOMS[room].programs.values():
            self.digests[program] = self.digest(program)

    def copies(self, room, changed_only=True, path=""):
        """Those of the folder that the mutated file lies in come first: they are likely to notice."""
        made = Copies(pathlib.Path(tempfile.mkdtemp(dir=self.folder)), self.build)
        own = max((f for f in ROOMS[room].programs if path.startswith(f + "/")), key=len, default="")
        for folder, program in sorted(ROOMS[room].programs.items(), key=lambda item: item[0] != own):
            if not changed_only or self.digest(program) != self.digests[program]:
                copy = made.folder / program
                copy.parent.mkdir(parents=True, exist_ok=True)
                shutil.copy2(self.build / program, copy)
                made.programs.append(copy)
        return made


def run_tests(copies, options):
    """("survived", "killed" or "hung", the test that noticed)."""
    try:
        for program in copies.programs:
            failed = run_parts(program, copies.build, options.timeout)
            if failed and confirmed(program, failed, copies.build, options.timeout):
                return ("hung" if failed.hung else "killed"), failed.test
        return "survived", ""
    finally:
        shutil.rmtree(copies.folder, ignore_errors=True)


@dataclass
class Failed:
    test: str
    hung: bool = False


def confirmed(program, failed, build, timeout):
    """A busy machine fails tests too: what failed must fail again."""
    again = start(program, build, f"--gtest_filter={failed.test}") if failed.test else start(program, build)
    return wait_for([again], timeout) is not None


def start(program, build, *words, **environment):
    log = tempfile.TemporaryFile("w+")
    process = subprocess.Popen([str(program), "--gtest_fail_fast", *words], stdout=log,
                               stderr=subprocess.STDOUT, start_new_session=True, cwd=build,
                               env={**os.environ, **environment})
    process.log = log
    return process


def run_parts(program, build, timeout):
    return wait_for([start(program, build, GTEST_TOTAL_SHARDS=str(PARTS), GTEST_SHARD_INDEX=str(i))
                     for i in range(PARTS)], timeout)


def wait_for(processes, timeout):
    """The first test that fails, or None. All have ended by then."""
    end = time.monotonic() + timeout
    try:
        while True:
            states = [p.poll() for p in processes]
            for process, state in zip(processes, states):
                if state not in (None, 0):
                    return Failed(named(process))
            if None not in states:
                return None
            if time.monotonic() > end:
                return Failed(named(next(p for p, s in zip(processes, states) if s is None)), hung=True)
            time.sleep(0.02)
    finally:
        for process in processes:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)
            process.wait()
            process.log.close()


def named(process):
    """The test that failed, or that ran when the program ended."""
    process.log.seek(0)
    text = process.log.read()
    found = re.findall(r"\[  FAILED  \] ([\w/.]+)", text) or re.findall(r"\[ RUN      \] ([\w/.]+)", text)[-1:]
    return found[0] if found else ""
