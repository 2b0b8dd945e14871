"""One daemon for one exciter: a second one, however it is started, sends nothing to it."""
import os
import pathlib
import shutil
import signal
import socket
import subprocess
import threading
import time
import unittest

from daemon import RIG, SHAKERD, Daemon

SERVICE, ANNA = 65534, 1  # any two users but root


class Wire:
    """An exciter that never answers: counts connections and bytes. In IDLE a daemon bears it."""

    def __init__(self):
        self.listener = socket.create_server(("127.0.0.1", 0), backlog=64)
        self.port = self.listener.getsockname()[1]
        self.heard = 0
        threading.Thread(target=self.accept, daemon=True).start()

    def accept(self):
        while True:
            try:
                connection, _ = self.listener.accept()
            except OSError:
                return
            self.heard += 1
            threading.Thread(target=self.listen, args=[connection], daemon=True).start()

    def listen(self, connection):
        with connection:
            try:
                while data := connection.recv(4096):
                    self.heard += len(data)
            except OSError:
                pass

    def until_heard(self):
        end = time.monotonic() + 20
        while not self.heard and time.monotonic() < end:
            time.sleep(0.01)
        return self.heard

    def until_quiet(self):
        """What has been heard, when a while was quiet."""
        while True:
            before = self.heard
            time.sleep(0.4)
            if self.heard == before:
                return before

    def close(self):
        self.listener.close()


def rig(port, host="127.0.0.1"):
    def link(number, unit):
        return {"transport": {"kind": "tcp", "host": host, "port": number}, "unit_id": unit}

    registers = {role: {"address": address, "type": "u16"} for address, role in
                 enumerate(("frequency", "amplitude", "enable", "ramp", "heartbeat"))}
    registers["heartbeat"]["cyclic"] = True
    registers |= {role: {"table": "input", "address": address, "type": "u16"} for address, role in
                  enumerate(("status", "fault"))}
    sensor = {"kind": "modbus", "link": link(1, 2),  # nobody is there
              "registers": {"displacement": {"address": 0, "type": "u16"}}}
    return dict(RIG, sensors=[sensor], exciter={
        "device": {"kind": "modbus", "link": link(port, 1), "registers": registers}, "ramp_s": 0.5})


def as_user(uid):
    return ["setpriv", f"--reuid={uid}", f"--regid={uid}", "--clear-groups"]


def users_can_be_changed():
    return os.geteuid() == 0 and shutil.which("setpriv") and subprocess.run(
        [*as_user(ANNA), SHAKERD, "--version"], capture_output=True).returncode == 0


class SomebodysDaemon(Daemon):
    """Started by `prefix`; its folder belongs to the user `uid`."""

    def __init__(self, content, uid=None, prefix=()):
        super().__init__(content)
        self.prefix = list(prefix) + (as_user(uid) if uid is not None else [])
        if uid is not None:
            for path in (self.directory, self.rig_file):
                os.chown(path, uid, uid)
            self.directory.chmod(0o755)

    def command(self, *words):
        return self.prefix + super().command(*words)


class OneExciter(unittest.TestCase):
    def setUp(self):
        self.wire, self.before = Wire(), None
        self.addCleanup(self.wire.close)

    def somebody(self, *arguments, host="127.0.0.1", **more):
        daemon = SomebodysDaemon(rig(self.wire.port, host), *arguments, **more)
        self.addCleanup(daemon.end)
        return daemon

    def first(self, **more):
        """Holds the exciter and sends nothing any more: what is heard after `self.before` is a second one's."""
        daemon = self.somebody(**more).start()
        self.assertGreater(self.wire.until_heard(), 0)
        self.freeze(daemon)
        return daemon

    def freeze(self, daemon):
        daemon.process.send_signal(signal.SIGSTOP)
        self.addCleanup(daemon.process.send_signal, signal.SIGCONT)
        self.before = self.wire.until_quiet()

    def refuse(self, *command, why="drives this exciter"):
        second = subprocess.run(command, capture_output=True, text=True, timeout=20)
        self.assertEqual(second.returncode, 3, second.stderr)
        self.assertIn(why, second.stderr)

    def tearDown(self):
        if self.before is not None:
            self.assertEqual(self.wire.until_quiet(), self.before)

class AnyDaemon(OneExciter):
    def test_an_editor_renames_the_rig_file(self):
        first = self.first()
        fresh = first.rig_file.with_suffix(".new")
        fresh.write_text(first.rig_file.read_text())
        fresh.rename(first.rig_file)
        self.refuse(SHAKERD, "--rig", str(first.rig_file), "--socket", str(first.directory / "other.sock"),
                    "--data", str(first.directory / "other"))

    def test_a_copy_a_link_and_another_name_of_this_pc(self):
        first = self.first()
        link = first.directory / "link.json"
        link.symlink_to(first.rig_file)
        self.refuse(SHAKERD, "--rig", str(link), "--socket", str(first.directory / "other.sock"),
                    "--data", str(first.directory / "other"))
        for host in ("127.0.0.1", "localhost", "127.0.0.2", "::ffff:127.0.0.1", "::1"):
            with self.subTest(host):
                self.refuse(*self.somebody(host=host).command())

    def test_the_same_folder(self):
        first = self.first()
        self.refuse(*first.command(), why="records in this directory")

    @unittest.skipUnless(users_can_be_changed(), "needs root, setpriv, and a build that others can read")
    def test_another_user(self):
        first = self.first()
        self.refuse(*self.somebody(ANNA).command(), why=f"root (pid {first.process.pid})")

    def test_who_refuses_does_not_stop_the_exciter_afterwards(self):
        """What the unit does after a daemon that was refused (ExecStopPost=)."""
        unit = (pathlib.Path(os.environ["SHAKER_SOURCE"]) / "systemd" / "shakerd.service.in").read_text()
        self.assertIn("shakerd-stop-exciter --unless-status 3 ", unit)
        first = self.first()
        stop = [str(pathlib.Path(SHAKERD).with_name("shakerd-stop-exciter")), "--unless-status", "3", "--for", "0",
                str(first.rig_file)]
        refused = dict(os.environ, EXIT_CODE="exited", EXIT_STATUS="3")
        self.assertEqual(subprocess.run(stop, env=refused, timeout=20).returncode, 0)
        self.assertEqual(self.wire.until_quiet(), self.before)
        crashed = dict(os.environ, EXIT_CODE="killed", EXIT_STATUS="KILL")
        subprocess.run(stop, env=crashed, timeout=20, capture_output=True)
        self.assertGreater(self.wire.until_quiet(), self.before)
        self.before = None


class Service(OneExciter):
    """With a /run of its own, whose folder shakerd belongs to the user SERVICE."""

    def setUp(self):
        if not users_can_be_changed():
            self.skipTest("needs root, setpriv, and a build that others can read")
        super().setUp()
        script = (f"mount -t tmpfs -o mode=755 tmpfs /run && mkdir -m 755 /run/shakerd && "
                  f"chown {SERVICE}:{SERVICE} /run/shakerd && echo ready && exec sleep 1000")
        self.room = subprocess.Popen(["unshare", "--mount", "--propagation", "private", "sh", "-c", script],
                                     stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        self.addCleanup(self.room.wait)
        self.addCleanup(self.room.kill)
        self.addCleanup(self.room.stdout.close)
        if self.room.stdout.readline() != "ready\n":
            self.skipTest("this kernel lets nobody have a /run of his own")
        self.inside = ["nsenter", "--mount", "--target", str(self.room.pid)]

    def test_a_plain_daemon_refuses_what_the_service_has(self):
        first = self.first(uid=SERVICE, prefix=self.inside)
        self.assertTrue(first.process.poll() is None)
        # The name as a stranger sees it is one thing, the service's folder the other.
        self.refuse(*self.somebody(ANNA, self.inside).command(), why=f"(pid {first.process.pid})")
        self.refuse(*self.somebody(SERVICE, self.inside).command(), why="the service")

    def test_the_service_has_precedence(self):
        plain = self.somebody(ANNA, self.inside).start()
        service = self.somebody(SERVICE, self.inside).start()
        self.assertEqual(plain.process.wait(20), 0)
        self.assertIn("wants the exciter", plain.log_text())
        self.assertIn("Ended.", plain.log_text())
        self.assertIn(f"(pid {plain.process.pid}) has the exciter", service.log_text())
        self.freeze(service)
        self.refuse(*self.somebody(ANNA, self.inside).command(), why=f"(pid {service.process.pid})")


if __name__ == "__main__":
    unittest.main()
