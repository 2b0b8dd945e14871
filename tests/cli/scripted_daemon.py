"""A daemon that says what the test wants, and the real shakerctl against it."""
import json
import os
import pathlib
import socket
import subprocess
import tempfile
import threading
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
SHAKERCTL = os.environ["SHAKERCTL"]
CAMPAIGN = ROOT / "config" / "examples" / "campaign-demo.json"
VERSION = {"type": "version", "program": "shakerd", "version": "9.9.9", "protocol": 1, "rig": "bench"}
IDLE = {"type": "state", "state": "IDLE", "reason": "ready", "controlled": False}


def state(name, **more):
    return {"type": "state", "state": name, "reason": "", "controlled": True, **more}


def estimate(usable=True):
    return {"type": "estimate", "model": "oleo", "usable": usable, "converged": True, "cycles_used": 1,
            "runs_used": 1, "warnings": [],
            "parameters": [{"name": "theta1", "effect": "orifice_damping", "unit": "1/m", "value": 16.6671,
                            "standard_error": 0.0213, "interval": [16.62, 16.71], "fixed": False,
                            "at_bound": False, "determined": True}]}


class Daemon:
    """Serves one client: greets it with `greeting`, then answers requests by `answers[method](self)`, which
    gives the result, or raises Refusal. `full` clients before it find no place."""

    def __init__(self, path, greeting, answers=None, full=0):
        self.path, self.greeting, self.answers = path, greeting, answers or {}
        self.requests, self.full = [], full
        self.listener = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        self.listener.bind(str(path))
        self.listener.listen(1)
        self.thread = threading.Thread(target=self.serve, daemon=True)
        self.thread.start()

    def say(self, *documents):
        for document in documents:
            line = document if isinstance(document, str) else json.dumps(document)
            self.client.sendall(line.encode() + b"\n")

    def serve(self):
        try:
            for _ in range(self.full):
                self.client, _ = self.listener.accept()
                with self.client:
                    self.say({"jsonrpc": "2.0", "id": None, "error": {"code": -32000, "message": "No place."}})
            self.client, _ = self.listener.accept()
        except OSError:  # closed before anyone came
            return
        with self.client:
            try:
                self.say(*self.greeting)
                for line in self.client.makefile("rb"):
                    self.answer(json.loads(line))
            except (OSError, HangUp):
                pass

    def answer(self, request):
        self.requests.append(request)
        reply = {"jsonrpc": "2.0", "id": request["id"]}
        try:
            reply["result"] = self.answers.get(request["method"], lambda daemon: {})(self)
        except Refusal as refusal:
            reply["error"] = {"code": -32000, "message": str(refusal)}
        if reply.get("result") is not None or "error" in reply:
            self.say(reply)

    def close(self):
        if self.listener.fileno() < 0:
            return
        self.listener.shutdown(socket.SHUT_RDWR)
        self.thread.join(10)
        self.listener.close()


class Refusal(Exception):
    pass


class HangUp(Exception):
    pass


def refuse(sentence):
    def answer(_):
        raise Refusal(sentence)
    return answer


def hang_up(daemon):
    daemon.listener.close()
    raise HangUp


class Online(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.socket = pathlib.Path(folder.name) / "s"

    def serve(self, greeting=(VERSION, IDLE), answers=None, full=0):
        daemon = Daemon(self.socket, greeting, answers, full)
        self.addCleanup(daemon.close)
        return daemon

    def shakerctl(self, *words):
        return subprocess.run([SHAKERCTL, *map(str, words), "--socket", self.socket], capture_output=True,
                              text=True, timeout=60)

    def on_a_terminal(self, seconds, meanwhile=lambda: None):
        """What `watch` writes to a terminal; `meanwhile` is called once it has drawn something."""
        master, terminal = os.openpty()
        program = subprocess.Popen([SHAKERCTL, "watch", "--seconds", str(seconds), "--socket", self.socket],
                                   stdout=terminal, stderr=subprocess.PIPE)
        os.close(terminal)
        screen = b""
        try:
            while chunk := os.read(master, 65536):
                screen += chunk
                meanwhile, once = (lambda: None), meanwhile
                once()
        except OSError:  # the terminal's other end is closed
            pass
        os.close(master)
        self.assertEqual(program.wait(30), 0, program.stderr.read())
        program.stderr.close()
        return screen.decode()
