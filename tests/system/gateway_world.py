"""A daemon with a gateway beside it."""
import http.client
import os
import re
import signal
import subprocess
import time
import unittest

from daemon import RIG, Client, Daemon

GATEWAY = os.environ["GATEWAY"]


class Gateway:
    def __init__(self, data, view, *words):
        self.words = [GATEWAY, "--socket", str(view), "--data", str(data), *words]
        self.port = 0
        self.process = None

    def start(self):
        self.process = subprocess.Popen([*self.words, "--port", str(self.port)], stdout=subprocess.PIPE,
                                        stderr=subprocess.DEVNULL, text=True)
        said = self.process.stdout.readline()
        self.port = int(re.search(r":(\d+)/", said).group(1))
        self.url = f"http://127.0.0.1:{self.port}/"
        return self

    def end(self):
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGTERM)
            self.process.wait(15)
        self.process.stdout.close()
        return self.process.returncode

    def get(self, path, method="GET", headers=None):
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=10)
        try:
            connection.request(method, path, headers=headers or {})
            answer = connection.getresponse()
            return answer.status, dict(answer.getheaders()), answer.read()
        finally:
            connection.close()


class World(unittest.TestCase):
    """A daemon with a view socket, and a gateway on it."""

    words = ()

    def setUp(self):
        self.daemon = Daemon({**RIG, "client_lease_s": 30})  # a busy machine may keep a browser's test waiting
        self.addCleanup(self.daemon.end)
        self.view = self.daemon.directory / "view.sock"
        self.daemon.more += ["--view-socket", str(self.view)]
        self.daemon.start()
        self.gateway = Gateway(self.daemon.data, self.view, *self.words).start()
        self.addCleanup(self.gateway.end)
        end = time.monotonic() + 10
        while b"shaker_state" not in self.gateway.get("/metrics")[2]:  # it has met the daemon
            self.assertLess(time.monotonic(), end)
            time.sleep(0.05)

    def operator(self):
        client = Client(self.daemon.socket)
        self.addCleanup(client.close)
        return client
