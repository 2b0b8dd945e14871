"""The command line, and what happens before there is a stream."""
import contextlib
import os
import signal
import subprocess
import time
import unittest

from daemon import Client, Daemon, RIG, SHAKERD, endless_campaign


class Start(unittest.TestCase):
    def run_it(self, rig, *words):
        daemon = Daemon(rig)
        self.addCleanup(daemon.end)
        return subprocess.run(daemon.command(*words), capture_output=True, text=True, timeout=20)

    def test_help_and_version(self):
        shown = subprocess.run([SHAKERD, "--help"], capture_output=True, text=True)
        self.assertEqual(shown.returncode, 0)
        for word in ("--rig", "--socket", "--data", "--tcp", "--check", "Exit status"):
            self.assertIn(word, shown.stdout)
        shown = subprocess.run([SHAKERD, "--version"], capture_output=True, text=True)
        self.assertRegex(shown.stdout, r"^shakerd \d+\.\d+\.\d+\n$")

    def test_check_says_what_is_in_the_rig_file(self):
        good = self.run_it(RIG, "--check")
        self.assertEqual(good.returncode, 0, good.stderr)
        self.assertIn('Rig "simulated"', good.stdout)

    def test_a_bad_rig_file_is_one_clear_complaint(self):
        bad = self.run_it(dict(RIG, surprise=1))
        self.assertEqual(bad.returncode, 2)
        self.assertIn("surprise", bad.stderr)
        self.assertIn("rig.json", bad.stderr)

    def test_bad_options(self):
        for words in ([], ["--rig"], ["--rig", "x", "--tcp", "99999"], ["--surprise"]):
            with self.subTest(words):
                bad = subprocess.run([SHAKERD, *words], capture_output=True, text=True)
                self.assertEqual(bad.returncode, 2)
                self.assertTrue(bad.stderr)

    def test_a_rig_file_that_is_not_there(self):
        bad = subprocess.run([SHAKERD, "--rig", "/nonexistent.json"], capture_output=True, text=True)
        self.assertEqual(bad.returncode, 2)
        self.assertIn("/nonexistent.json", bad.stderr)


class Inherited(unittest.TestCase):
    """What a shell, a terminal or a pipe does to the daemon."""

    def start(self, **how):
        self.daemon = Daemon()
        self.addCleanup(self.daemon.end)
        self.daemon.log = open(self.daemon.directory / "log", "ab")
        process = subprocess.Popen(self.daemon.command(), **{"stdout": self.daemon.log, "stderr": self.daemon.log, **how})
        self.daemon.process = process
        end = time.monotonic() + 20
        while time.monotonic() < end and process.poll() is None:
            with contextlib.suppress(OSError):
                self.client = Client(self.daemon.socket)
                self.addCleanup(self.client.close)
                return process
            time.sleep(0.02)
        raise AssertionError(f"shakerd did not start, its status is {process.poll()}")

    def test_it_goes_on_when_nobody_reads_its_log_any_more(self):
        process = self.start(stderr=subprocess.PIPE)
        self.assertTrue(process.stderr.readline())
        process.stderr.close()
        for _ in range(5):  # each is worth a line
            with contextlib.closing(Client(self.daemon.socket)) as client:
                self.assertIn("result", client.ask("ping"))
        self.assertIn("result", self.client.ask("ping"))
        process.send_signal(signal.SIGTERM)
        self.assertEqual(process.wait(20), 0)

    def test_a_terminal_that_closes_ends_it_with_a_ramp(self):
        process = self.start()
        self.client.start(endless_campaign())
        self.client.until_state("RAMP")
        process.send_signal(signal.SIGHUP)
        self.client.until_state("RAMP_DOWN", start=len(self.client.lines))
        self.assertEqual(process.wait(20), 0)

    def test_nohup_is_respected(self):
        process = self.start(preexec_fn=lambda: signal.signal(signal.SIGHUP, signal.SIG_IGN))
        process.send_signal(signal.SIGHUP)
        self.assertEqual(self.client.ask("status")["result"]["state"]["state"], "IDLE")
        status = open(f"/proc/{process.pid}/status").read()
        ignored = int(next(line.split()[1] for line in status.splitlines() if line.startswith("SigIgn:")), 16)
        self.assertTrue(ignored >> (signal.SIGHUP - 1) & 1)

    def test_closed_standard_files_do_not_become_a_database_or_a_socket(self):
        process = self.start(preexec_fn=lambda: [os.close(fd) for fd in range(3)])
        for fd in range(3):
            self.assertEqual(os.readlink(f"/proc/{process.pid}/fd/{fd}"), "/dev/null")
        self.assertIn("result", self.client.ask("ping"))

    def test_it_asks_nobody_else_for_the_names_of_users(self):
        """A name server that hangs (LDAP) would hang the C library's getpwuid."""
        used = subprocess.run(["nm", "-D", SHAKERD], capture_output=True, text=True)
        if "__asan_init" in used.stdout or "__tsan_init" in used.stdout:
            self.skipTest("a sanitizer asks for everything")
        self.assertIn("fgetpwent_r", used.stdout)
        self.assertNotIn(" U getpw", used.stdout)
        self.assertNotIn(" U getgr", used.stdout)


if __name__ == "__main__":
    unittest.main()
