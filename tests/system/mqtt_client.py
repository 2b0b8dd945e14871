"""A broker of Debian's mosquitto on a free port, and a subscriber that shares no code with it (MQTT 3.1.1)."""
import contextlib
import os
import pathlib
import shutil
import socket
import struct
import subprocess
import tempfile
import threading
import time

PROGRAM = shutil.which("mosquitto", path=os.environ.get("PATH", "") + ":/usr/sbin")
CONNECT, CONNACK, PUBLISH, PUBACK, SUBSCRIBE, SUBACK = 1, 2, 3, 4, 8, 9


class Broker:
    """Keeps nothing on disk: one that is started anew has forgotten all that was retained."""

    def __init__(self, *lines):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="broker."))
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            self.port = free.getsockname()[1]
        if os.geteuid() == 0:
            lines = ("user root", *lines)
        (self.folder / "conf").write_text("\n".join(
            [f"listener {self.port} 127.0.0.1", "persistence false", *(lines or ()),
             *(() if any("password_file" in line for line in lines) else ("allow_anonymous true",)), ""]))
        self.process = None

    def start(self):
        self.log = open(self.folder / "log", "ab")
        self.process = subprocess.Popen([PROGRAM, "-c", str(self.folder / "conf")], stdout=self.log, stderr=self.log)
        end = time.monotonic() + 10
        while True:
            with contextlib.suppress(OSError), socket.create_connection(("127.0.0.1", self.port), 1):
                return self
            if self.process.poll() is not None or time.monotonic() > end:
                raise AssertionError(f"mosquitto did not start:\n{(self.folder / 'log').read_text()}")
            time.sleep(0.02)

    def signal(self, number):
        self.process.send_signal(number)

    def kill(self):
        self.process.kill()
        self.process.wait()
        self.log.close()

    def end(self):
        if self.process.poll() is None:
            self.kill()
        shutil.rmtree(self.folder, ignore_errors=True)


def text(value):
    data = value.encode()
    return struct.pack(">H", len(data)) + data


class Message:
    def __init__(self, topic, payload, qos, retained):
        self.topic, self.payload, self.qos, self.retained = topic, payload, qos, retained
        self.kind = topic.rsplit("/", 1)[-1]
        self.at = time.monotonic()


class Subscriber:
    """Every message is kept in `messages`, by a thread of its own."""

    def __init__(self, port, topics="#"):
        self.socket = socket.create_connection(("127.0.0.1", port), timeout=5)
        self.messages, self.rest, self.closed = [], b"", False
        self.send(CONNECT << 4, text("MQTT") + bytes([4, 2]) + struct.pack(">H", 0) + text(f"test-{time.time_ns()}"))
        answer = self.packet()
        assert answer == (CONNACK << 4, b"\0\0"), answer
        self.send(SUBSCRIBE << 4 | 2, struct.pack(">H", 1) + text(topics) + b"\1")
        answer = self.packet()
        assert answer == (SUBACK << 4, b"\0\1\1"), answer
        self.socket.settimeout(None)
        threading.Thread(target=self.read, daemon=True).start()

    def send(self, head, body):
        assert len(body) < 128
        self.socket.sendall(bytes([head, len(body)]) + body)

    def exactly(self, count):
        while len(self.rest) < count:
            data = self.socket.recv(65536)
            if not data:
                raise ConnectionResetError
            self.rest += data
        data, self.rest = self.rest[:count], self.rest[count:]
        return data

    def packet(self):
        head, length, shift = self.exactly(1)[0], 0, 0
        while True:
            byte = self.exactly(1)[0]
            length |= (byte & 127) << shift
            shift += 7
            if byte < 128:
                return head, self.exactly(length)

    def read(self):
        try:
            while True:
                head, body = self.packet()
                if head >> 4 != PUBLISH:
                    continue
                qos, length = head >> 1 & 3, struct.unpack(">H", body[:2])[0]
                topic, body = body[2:2 + length].decode(), body[2 + length:]
                if qos:
                    self.send(PUBACK << 4, body[:2])
                    body = body[2:]
                self.messages.append(Message(topic, body.decode(), qos, bool(head & 1)))
        except OSError:
            self.closed = True

    def of_kind(self, kind):
        return [message for message in self.messages if message.kind == kind]

    def until(self, wanted, timeout=10):
        """The first message for which wanted(message)."""
        end = time.monotonic() + timeout
        while True:
            for message in list(self.messages):
                if wanted(message):
                    return message
            if time.monotonic() > end or self.closed:
                raise AssertionError("\n".join(f"{m.topic} {m.payload[:300]}" for m in self.messages[-20:]) or
                                     "nothing came")
            time.sleep(0.01)

    def close(self):
        with contextlib.suppress(OSError):
            self.socket.shutdown(socket.SHUT_RDWR)
        self.socket.close()
