"""Where the programs and the helpers of other tests are, for those who start a script by hand."""
import contextlib
import os
import pathlib
import shutil
import signal
import sys
import threading
import time

SOURCE = pathlib.Path(__file__).resolve().parents[2]
BIN = pathlib.Path(os.environ.get("SHAKER_BIN", SOURCE / "build" / "bin"))
for variable, path in {"SHAKERD": BIN / "shakerd", "SHAKERCTL": BIN / "shakerctl",
                       "OLEOSIM": BIN / "oleosim", "SHAKER_SOURCE": SOURCE}.items():
    os.environ.setdefault(variable, str(path))
sys.path.insert(0, str(SOURCE / "tests" / "system"))


def memory():
    """Where a stand's files lie: in memory, if there is room, so that a busy disk is no fault of its own."""
    with contextlib.suppress(OSError):
        if shutil.disk_usage("/dev/shm").free > 2**30 and os.access("/dev/shm", os.W_OK):
            return "/dev/shm"
    return None


def end_with_parent():
    """For a process that a script forks: it ends when the script has. (The kernel's own signal for that would
    come when the thread that forked has ended, and a pool's thread ends before its processes.)"""
    parent = os.getppid()

    def watch():
        while os.getppid() == parent:
            time.sleep(1.0)
        os.kill(os.getpid(), signal.SIGKILL)
    threading.Thread(target=watch, daemon=True).start()


class Progress:
    """On a terminal one line that is written over; elsewhere a line each minute."""

    def __init__(self):
        self.due = time.monotonic() + 60

    def show(self, text):
        if sys.stdout.isatty():
            print(f"\r\033[K{text}", end="", flush=True)
        elif time.monotonic() >= self.due:
            print(text, flush=True)
            self.due = time.monotonic() + 60
