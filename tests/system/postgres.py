"""A real PostgreSQL server in a folder of its own, as a user without rights, and a proxy that cuts its connections."""
import contextlib
import json
import os
import pathlib
import pwd
import shutil
import signal
import socket
import subprocess
import tempfile
import threading
import time


def programs():
    """The folder of the newest server's programs, or None."""
    found = sorted(pathlib.Path("/usr/lib/postgresql").glob("*/bin/postgres"), key=lambda path: int(path.parts[4]))
    return found[-1].parent if found else None


def free_port():
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        return free.getsockname()[1]


class Server:
    """`trust` for everybody who reaches it on 127.0.0.1; the superuser is `lab`."""

    def __init__(self):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="postgres."))
        self.user = {}
        if os.getuid() == 0:  # the server refuses root
            nobody = pwd.getpwnam("nobody")
            os.chown(self.folder, nobody.pw_uid, nobody.pw_gid)
            self.user = {"user": nobody.pw_uid, "group": nobody.pw_gid, "extra_groups": []}
        self.data = self.folder / "data"
        self.port = free_port()
        subprocess.run([programs() / "initdb", "-D", self.data, "-A", "trust", "-U", "lab", "--no-sync", "-E", "UTF8",
                        "--locale=C.UTF-8"], check=True, capture_output=True, cwd="/", **self.user)
        self.process = None

    def start(self):
        self.log = open(self.folder / "log", "ab")
        self.process = subprocess.Popen(
            [programs() / "postgres", "-D", self.data, "-k", self.folder, "-p", str(self.port),
             "-c", "listen_addresses=127.0.0.1", "-c", "fsync=off"],
            stderr=self.log, stdout=self.log, cwd="/", start_new_session=True, **self.user)
        end = time.monotonic() + 30
        while subprocess.run([programs() / "pg_isready", "-h", "127.0.0.1", "-p", str(self.port), "-q"]).returncode:
            if time.monotonic() > end or self.process.poll() is not None:
                raise AssertionError((self.folder / "log").read_text())
            time.sleep(0.05)
        return self

    def stop(self):
        self.process.send_signal(signal.SIGQUIT)  # at once, as in a crash
        self.process.wait(20)
        self.log.close()

    def freeze(self, frozen):
        """Every process of the server, those of connections too."""
        os.killpg(self.process.pid, signal.SIGSTOP if frozen else signal.SIGCONT)

    def end(self):
        if self.process and self.process.poll() is None:
            self.freeze(False)
            self.stop()
        shutil.rmtree(self.folder, ignore_errors=True)

    def where(self, database, user="lab", port=None):
        return f"host=127.0.0.1 port={port or self.port} dbname={database} user={user}"

    def sql(self, database, text):
        """The rows of a query, as psql prints them."""
        done = subprocess.run([programs() / "psql", "-X", "-q", "-v", "ON_ERROR_STOP=1", "-A", "-t",
                               self.where(database)], input=text, capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
        return done.stdout.splitlines()

    def rows(self, database, query):
        return json.loads("\n".join(self.sql(database, f"SELECT coalesce(json_agg(q), '[]') FROM ({query}) q;")))

    def dump(self, database):
        done = subprocess.run([programs() / "pg_dump", "-d", self.where(database)], capture_output=True, check=True)
        return [line for line in done.stdout.splitlines() if not line.startswith((b"\\restrict", b"\\unrestrict"))]


class Proxy:
    """Passes connections on, and cuts each after so many bytes from the client."""

    def __init__(self, port, most):
        self.target, self.most = port, most
        self.listening = socket.create_server(("127.0.0.1", 0))
        self.port = self.listening.getsockname()[1]
        self.passed = 0
        self.thread = threading.Thread(target=self.serve, daemon=True)
        self.thread.start()

    def serve(self):
        with contextlib.suppress(OSError):
            while True:
                client, _ = self.listening.accept()
                server = socket.create_connection(("127.0.0.1", self.target))
                threading.Thread(target=self.back, args=(server, client), daemon=True).start()
                self.forth(client, server)

    def forth(self, client, server):
        left = self.most
        with contextlib.suppress(OSError):
            while left > 0 and (data := client.recv(min(left, 65536))):
                server.sendall(data)
                left -= len(data)
                self.passed += len(data)
        for end in (client, server):
            with contextlib.suppress(OSError):
                end.shutdown(socket.SHUT_RDWR)
            end.close()

    def back(self, server, client):
        with contextlib.suppress(OSError):
            while data := server.recv(65536):
                client.sendall(data)

    def end(self):
        self.listening.shutdown(socket.SHUT_RDWR)
        self.listening.close()
