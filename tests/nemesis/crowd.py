"""Clients that do the daemon harm: many, mute, greedy, or with something awkward to parse.

Those that work hard run in a process of their own, this file as a program: they must not take the
time of the proxy and the observer.
"""
import contextlib
import json
import os
import pathlib
import random
import socket
import subprocess
import sys
import threading
import time

# Nothing outlives a test that is killed itself.
DIES_WITH_US = ("/usr/bin/setpriv", "--pdeathsig", "KILL")


def connect(path, timeout=1.0):
    """A listener whose queue is full, as behind a crowd, refuses at once and not after the time: it is asked again."""
    end = time.monotonic() + timeout
    while True:
        link = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        link.settimeout(timeout)
        try:
            link.connect(str(path))
            return link
        except BlockingIOError:
            link.close()
            if time.monotonic() > end:
                raise
            time.sleep(0.01)


def connect_tcp(port):
    return socket.create_connection(("127.0.0.1", port), 1.0)


def close_all(links):
    def lift():
        for link in links:
            link.close()
    return lift


def crowd(dial, count):
    """So many connections that are held and never read."""
    links = []
    for _ in range(count):
        with contextlib.suppress(OSError):
            links.append(dial())
    return close_all(links)


def half_open(path, count=10):
    """Connections that have begun a request, and never end it."""
    links = []
    for _ in range(count):
        with contextlib.suppress(OSError):
            link = connect(path)
            link.sendall(b'{"jsonrpc":"2.0","id":1,"met')
            links.append(link)
    return close_all(links)


RUBBISH = (
    b"\xff\xfe\x00\x01\n", b"[" * 33000 + b"\n", b'{"jsonrpc":"2.0","id":"' + b"x" * 60000 + b'"}\n',
    b"[" + b",".join([b'{"jsonrpc":"2.0","method":"estop"}'] * 200) + b"]\n",
    b"a" * 1_000_000 + b"\n", b'{"jsonrpc":"2.0","id":1,"method":"campaign.start","params":{}}\n',
    b'{"jsonrpc":"2.0","id":{},"method":[]}\n', b"\n\n\n\0\n")


class Streams:
    """Threads that each run `work(link, ended, number)` on a connection of their own until they are lifted."""

    def __init__(self, dial, count, work):
        self.dial, self.work = dial, work
        self.ended = threading.Event()
        self.threads = [threading.Thread(target=self.run, args=(i,), daemon=True) for i in range(count)]
        for thread in self.threads:
            thread.start()

    def run(self, number):
        while not self.ended.is_set():
            with contextlib.suppress(OSError), contextlib.closing(self.dial()) as link:
                self.work(link, self.ended, number)
            self.ended.wait(0.05)

    def lift(self):
        self.ended.set()
        for thread in self.threads:
            thread.join(5)


def mob(kind, address, count, seed):
    """Streams of KINDS in another process; the function that ends it."""
    process = subprocess.Popen([*DIES_WITH_US, sys.executable, __file__, kind, str(address), str(count), seed])

    def lift():
        process.kill()
        process.wait()
    return lift


def rubbish(link, ended, _):
    link.sendall(random.choice(RUBBISH))
    ended.wait(0.02)
    link.recv(65536)


def never_reads(link, ended, _):
    """Asks and asks, and reads no answer."""
    request = b'{"jsonrpc":"2.0","id":1,"method":"status"}\n' * 100
    while not ended.is_set():
        with contextlib.suppress(TimeoutError):
            link.sendall(request)
        ended.wait(0.002)


def never_looks(link, ended, number):
    """Wants everything that there is to look at, and reads none of it."""
    link.sendall(b'{"jsonrpc":"2.0","id":1,"method":"subscribe",'
                 b'"params":{"documents":["wave","scope","rig"]}}\n')
    never_reads(link, ended, number)


def floods(link, ended, _):
    """Requests as fast as they are answered, all answers read: two cores are shared, so with a breath."""
    link.setblocking(False)
    request = b'{"jsonrpc":"2.0","id":1,"method":"status"}\n' * 20
    while not ended.is_set():
        with contextlib.suppress(BlockingIOError):
            link.send(request)
        with contextlib.suppress(BlockingIOError):
            while link.recv(1 << 20):
                pass
        ended.wait(0.005)


KINDS = {"rubbish": rubbish, "never_reads": never_reads, "never_looks": never_looks, "floods": floods}


class FlippedFile:
    """A campaign's path that is a file now and a FIFO then: an open that races with it may hang."""

    def __init__(self, folder, socket_path, campaign):
        self.path = pathlib.Path(folder) / "flipped.json"
        self.good = pathlib.Path(folder) / "good.json"
        self.good.write_text(json.dumps(campaign))
        self.ended = threading.Event()
        self.flipper = threading.Thread(target=self.flip, daemon=True)
        self.flipper.start()
        self.streams = Streams(lambda: connect(socket_path), 2, self.ask)

    def flip(self):
        fifo, link = self.path.with_suffix(".fifo"), self.path.with_suffix(".link")
        with contextlib.suppress(FileExistsError):
            os.mkfifo(fifo)
        while not self.ended.is_set():
            for target in (self.good, fifo):
                os.symlink(target, link)
                os.replace(link, self.path)
                time.sleep(0.0005)

    def ask(self, link, ended, _):
        request = json.dumps({"jsonrpc": "2.0", "id": 1, "method": "campaign.start",
                              "params": {"file": str(self.path)}}).encode() + b"\n"
        while not ended.is_set():
            link.sendall(request)
            link.recv(1 << 16)

    def lift(self):
        self.ended.set()
        self.flipper.join(5)
        self.streams.lift()


def many_keys(folder, count=80_000):
    """A campaign file that a quadratic reader takes seconds for."""
    path = pathlib.Path(folder) / "many.json"
    path.write_text("{" + ",".join(f'"k{i}":0' for i in range(count)) + "}")
    return path


def main():
    kind, address, count, seed = sys.argv[1:]
    random.seed(seed)
    dial = (lambda: connect_tcp(int(address))) if address.isdigit() else lambda: connect(address)
    Streams(dial, int(count), KINDS[kind]).ended.wait()


if __name__ == "__main__":
    main()
