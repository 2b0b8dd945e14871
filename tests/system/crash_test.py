"""kill -9 in mid-run: nothing that was seen is missing, and the next daemon says what it found."""
import os
import shutil
import sqlite3
import subprocess
import sys
import unittest

from daemon import SOURCE, Client, Daemon, Schemas, endless_campaign

NEMESIS = SOURCE / "tests" / "nemesis"


class Crash(unittest.TestCase):
    def setUp(self):
        self.daemon = Daemon().start()
        self.addCleanup(self.daemon.end)

    def run_and_kill(self, estimates):
        client = Client(self.daemon.socket)
        client.start(endless_campaign())
        client.until(lambda line: len(client.of_type("estimate")) >= estimates, 45)
        self.daemon.kill()
        while not client.closed:
            client.read(1)
        return client

    def test_everything_acknowledged_is_there_after_kill(self):
        for life in (1, 2):  # recovery is tested twice in a row
            client = self.run_and_kill(5)
            self.daemon.start()
            after = Client(self.daemon.socket)
            alarm = after.until(lambda line: line.get("code") == "campaign_interrupted", 10)  # checked by then
            file = self.daemon.databases()[-1]
            with sqlite3.connect(file) as database:
                kept = {line for (line,) in database.execute("SELECT line FROM document")}
                cycles = set(database.execute("SELECT idx FROM cycle WHERE accepted"))
                samples, = database.execute("SELECT sum(count) FROM sample").fetchone()
                status, = database.execute("SELECT status FROM campaign").fetchone()
            for raw, line in zip(client.raw, client.lines):
                if line.get("type") in ("run_start", "cycle", "estimate"):
                    self.assertIn(raw, kept)
                if line.get("type") == "cycle" and line["accepted"]:
                    self.assertIn((line["cycle"],), cycles)
            self.assertEqual(status, "interrupted")

            self.assertEqual(Schemas().faults(alarm), [])
            self.assertIn(f"{samples} samples", alarm["text"])
            self.assertIn("endless", alarm["text"])
            self.daemon.until_logged(alarm["text"])
            self.assertEqual(after.ask("status")["result"]["state"]["state"], "IDLE")
            after.close()
            self.assertEqual(len(self.daemon.databases()), life)

    def test_a_damaged_database_does_not_keep_the_daemon_from_starting(self):
        self.run_and_kill(1)
        [file] = self.daemon.databases()
        for log in self.daemon.data.glob("*-wal"):
            log.unlink()
        file.write_bytes(b"\x5a" * 20_000)
        (self.daemon.data / "rubbish.db").write_bytes(b"not a database")
        self.daemon.start()
        after = Client(self.daemon.socket)
        for name in (file.name, "rubbish.db"):  # one alarm a file, after the file was set aside
            after.until(lambda line, name=name: line.get("code") == "campaign_damaged" and name in line["text"], 5)
        self.assertFalse(file.exists())
        self.assertEqual(len(list(self.daemon.data.glob("*.damaged-*Z"))), 2)
        after.start(endless_campaign())
        after.until_state("CHECK", "RAMP", "SETTLE")

    @unittest.skipUnless(NEMESIS.is_dir() and shutil.which("gcc"), "no compiler for a disk that hangs")
    def test_a_check_that_hangs_keeps_neither_the_exciter_from_its_stop_nor_a_client_waiting(self):
        """As with a file that takes minutes to check: the exciter is stopped, and the daemon answers, before."""
        sys.path.append(str(NEMESIS))
        import shim
        self.run_and_kill(1)
        hanging = shim.Shim(shim.compiled(self.daemon.directory), self.daemon.directory, self.daemon.data)
        self.addCleanup(hanging.close)
        hanging.order(shim.FLUSH_HANGS)
        os.environ.update(pair.split("=", 1) for pair in hanging.environment)
        try:
            self.daemon.start()
        finally:
            for pair in hanging.environment:
                del os.environ[pair.split("=")[0]]
        after = Client(self.daemon.socket)
        health = after.until(lambda line: line.get("type") == "health", 10)
        self.assertTrue(health["exciter_connected"])  # only after its first order, which is a stop
        self.assertGreater(hanging.hits, 0)
        self.assertEqual(after.of_type("alarm"), [])
        self.assertEqual(after.ask("status")["result"]["state"]["state"], "IDLE")
        hanging.lift()
        after.until(lambda line: line.get("code") == "campaign_interrupted", 20)

    def test_a_second_daemon_is_refused(self):
        second = subprocess.run(self.daemon.command(), capture_output=True, text=True, timeout=20)
        self.assertEqual(second.returncode, 3)
        self.assertIn("another shakerd records in this directory", second.stderr)
        self.assertIn("result", Client(self.daemon.socket).ask("ping"))


if __name__ == "__main__":
    unittest.main()
