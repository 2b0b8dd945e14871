"""One thread of a process stopped by ptrace, while the others go on (SIGSTOP stops them all)."""
import ctypes
import os
import pathlib
import threading

SEIZE, INTERRUPT, DETACH = 0x4206, 0x4207, 17
WALL = 0x40000000
libc = ctypes.CDLL(None, use_errno=True)
libc.ptrace.argtypes = [ctypes.c_long, ctypes.c_long, ctypes.c_void_p, ctypes.c_void_p]
libc.ptrace.restype = ctypes.c_long


def threads(pid):
    """{name: [tid]}; the first thread of a process is called "main" here, whatever its name."""
    found = {}
    for task in sorted(pathlib.Path(f"/proc/{pid}/task").iterdir(), key=lambda path: int(path.name)):
        try:
            name = (task / "comm").read_text().strip()
        except OSError:
            continue  # it has ended meanwhile
        name = "main" if int(task.name) == pid else name
        found.setdefault(name, []).append(int(task.name))
    return found


def ptrace(request, tid):
    if libc.ptrace(request, tid, None, None) != 0:
        code = ctypes.get_errno()
        raise OSError(code, f"ptrace of thread {tid}: {os.strerror(code)}")


class Frozen(threading.Thread):
    """All of ptrace's calls must come from the thread that seized: this one."""

    def __init__(self, tids):
        super().__init__(daemon=True)
        self.tids = tids
        self.trouble = None
        self.stopped, self.thaw = threading.Event(), threading.Event()
        self.start()
        self.stopped.wait(5)
        if self.trouble:
            raise self.trouble

    def run(self):
        seized = []
        try:
            for tid in self.tids:
                ptrace(SEIZE, tid)
                seized.append(tid)
                ptrace(INTERRUPT, tid)
                os.waitpid(tid, WALL)
        except OSError as trouble:
            self.trouble = trouble
            self.thaw.set()
        self.stopped.set()
        while not self.thaw.wait(0.02):
            # A traced thread that was killed stays, and its process with it, until it is waited for.
            for tid in [t for t in seized if self.has_ended(t)]:
                seized.remove(tid)
        for tid in seized:
            try:
                ptrace(DETACH, tid)
            except OSError:
                pass  # it has been killed

    def has_ended(self, tid):
        try:
            found, status = os.waitpid(tid, WALL | os.WNOHANG)
        except ChildProcessError:
            return True
        return found != 0 and (os.WIFEXITED(status) or os.WIFSIGNALED(status))

    def lift(self):
        self.thaw.set()
        self.join(5)
