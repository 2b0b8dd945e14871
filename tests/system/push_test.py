"""shakerctl push into a real PostgreSQL server: what is there, twice, cut off, away, frozen, without rights."""
import contextlib
import json
import os
import pathlib
import shutil
import sqlite3
import struct
import subprocess
import tempfile
import time
import unittest

import postgres
from daemon import RIG, Client, Daemon, endless_campaign

SHAKERCTL = os.environ["SHAKERCTL"]
NOTE = 'charge "18 bar"\tno\\leak\nsecond line: \\. \\N µ'
TABLES = ("campaign", "run", "cycle", "estimate", "parameter", "alarm", "fact")


def of_file(file, query):
    with contextlib.closing(sqlite3.connect(file)) as database:
        return database.execute(query).fetchall()


def documents(file, kind):
    lines = [json.loads(line) for line, in of_file(file, "SELECT line FROM document ORDER BY seq")]
    return [document for document in lines if document["type"] == kind]


def doubles(blob):
    return list(struct.unpack(f"<{len(blob) // 8}d", blob))


@unittest.skipUnless(postgres.programs(), "there is no PostgreSQL server: `push` is not tried")
class Push(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.server = postgres.Server().start()
        cls.addClassCleanup(cls.server.end)
        cls.folder = pathlib.Path(tempfile.mkdtemp(prefix="push."))
        cls.addClassCleanup(shutil.rmtree, cls.folder, ignore_errors=True)
        cls.measure()

    @classmethod
    def measure(cls):
        """A campaign with estimates and an emergency stop; it is pushed once in the middle."""
        # The test waits for `push`, and a busy machine keeps the sensor waiting.
        rig = {**RIG, "client_lease_s": 30, "limits": {**RIG["limits"], "stale_s": 2.0}}
        daemon = Daemon(rig).start()
        cls.addClassCleanup(daemon.end)
        operator = Client(daemon.socket)
        cls.addClassCleanup(operator.close)
        operator.start(endless_campaign())
        operator.until(lambda line: line.get("type") == "estimate" and line["cycles_used"] >= 3, 45)
        cls.server.sql("postgres", "CREATE DATABASE live;")
        # As the service does: by another user of the group, who may only read.
        daemon.directory.chmod(0o755)
        may_only_read = ["setpriv", "--reuid", "65534", "--regid", "0", "--clear-groups"] if os.getuid() == 0 else []
        cls.midway = subprocess.run([*may_only_read, SHAKERCTL, "push", daemon.data, "--to", cls.server.where("live")],
                                    capture_output=True, text=True, timeout=60)
        cls.midway_rows = cls.server.rows("live", "SELECT status, complete FROM shaker.campaign")
        operator.ask("estop")
        operator.until_state("FAULT")
        daemon.campaign_status()
        [made] = daemon.databases()
        log, end = made.with_name(made.name + "-wal"), time.monotonic() + 30
        while log.exists() and log.stat().st_size:  # the recorder closes the file a moment later
            assert time.monotonic() < end, "the recorder does not close the file"
            time.sleep(0.05)
        cls.file = pathlib.Path(shutil.copy(made, cls.folder))

    @staticmethod
    def call(*words, **more):
        return subprocess.run([SHAKERCTL, "push", *map(str, words)], capture_output=True, text=True, timeout=60, **more)

    def setUp(self):
        self.database = self.id().rsplit("_", 1)[-1] + str(time.monotonic_ns())
        self.server.sql("postgres", f"CREATE DATABASE {self.database};")

    def push(self, *words, code=0, database=None, **more):
        done = self.call(*words, "--to", self.server.where(database or self.database, **more))
        self.assertEqual(done.returncode, code, done.stdout + done.stderr)
        return done

    def content(self, database=None):
        """Every row of every table but the numbers that the server gave the campaigns."""
        columns = {"campaign": "host, rig, name, started_utc, finished_utc, status, complete, file, model, "
                               "campaign_file::text, model_file::text"}
        return {table: sorted(map(json.dumps, self.server.rows(
            database or self.database, f"SELECT {columns.get(table, '*')} FROM shaker.{table}"))) for table in TABLES}

    def test_all_that_the_file_holds_is_in_the_tables(self):
        self.push(self.file)
        rows = lambda query: self.server.rows(self.database, query)
        [(name, started, rig, status, finished)] = of_file(
            self.file, "SELECT name, started_utc, rig, status, finished_utc FROM campaign")
        [campaign] = rows("SELECT *, extract(epoch FROM finished_utc - started_utc) AS took FROM shaker.campaign")
        self.assertEqual((campaign["name"], campaign["rig"], campaign["status"], campaign["complete"]),
                         (name, rig, status, True))
        self.assertEqual(campaign["started_utc"][:19], started[:19])
        self.assertTrue(0 < campaign["took"] < 60, finished)
        self.assertEqual(campaign["host"], of_file(self.file, "SELECT value FROM fact WHERE kind = 'host'")[0][0])
        cycles = of_file(self.file, "SELECT run, idx, accepted, frequency_hz, amplitude, excitation_error, displacement, "
                                    "excitation FROM cycle ORDER BY run, idx")
        self.assertGreater(len(cycles), 5)
        self.assertEqual(
            [(c["run"], c["cycle"], c["accepted"], c["frequency_hz"], c["amplitude"], c["excitation_error"],
              c["displacement"], c["excitation"]) for c in rows("SELECT * FROM shaker.cycle ORDER BY run, cycle")],
            [(*c[:2], bool(c[2]), *c[3:6], doubles(c[6]), doubles(c[7])) for c in cycles])
        self.assertEqual([(r["run"], r["name"], r["frequency_hz"], r["amplitude"], r["cycles_wanted"])
                          for r in rows("SELECT * FROM shaker.run ORDER BY run")],
                         of_file(self.file, "SELECT idx, name, frequency_hz, amplitude, cycles_wanted FROM run"))
        for table in ("estimate", "alarm"):
            self.assertEqual([row["document"] for row in rows(f"SELECT document FROM shaker.{table} ORDER BY seq")],
                             documents(self.file, table))
        self.assertIn("emergency_stop", [row["code"] for row in rows("SELECT code FROM shaker.alarm")])
        self.assertEqual([(f["kind"], f["name"], f["value"], f["utc"], f["sha256"])
                          for f in rows("SELECT * FROM shaker.fact ORDER BY fact")],
                         of_file(self.file, "SELECT kind, name, value, utc, sha256 FROM fact ORDER BY id"))

    def test_parameters_are_those_of_the_estimates(self):
        self.push(self.file)
        wanted = [(e["seq"], p["name"], p["unit"], p["value"], p["standard_error"], *p["interval"], p["fixed"])
                  for e in documents(self.file, "estimate") for p in e["parameters"] if "interval" in p]
        self.assertGreater(len(wanted), 5)
        rows = self.server.rows(self.database, "SELECT * FROM shaker.parameter WHERE lower IS NOT NULL")
        self.assertEqual(sorted((r["seq"], r["name"], r["unit"], r["value"], r["standard_error"], r["lower"], r["upper"],
                                 r["fixed"]) for r in rows), sorted(wanted))

    def test_a_campaign_that_goes_on_is_completed_by_the_next_push(self):
        self.assertEqual(self.midway.returncode, 0, self.midway.stderr)
        self.assertIn("The campaign goes on", self.midway.stdout)
        self.assertEqual(self.midway_rows, [{"status": "running", "complete": False}])
        self.push(self.file, database="live")
        self.push(self.file)
        self.assertEqual(self.content("live"), self.content())

    def test_twice_changes_nothing(self):
        self.push(self.file)
        before = self.server.dump(self.database)
        self.assertIn("all of it was there", self.push(self.folder).stdout)
        self.assertEqual(self.server.dump(self.database), before)

    def test_a_note_is_added_with_all_its_characters(self):
        copy = self.folder / "noted"
        copy.mkdir()
        file = pathlib.Path(shutil.copy(self.file, copy))
        self.push(file)
        subprocess.run([SHAKERCTL, "note", file, NOTE], check=True, capture_output=True)
        self.assertIn("1 facts", self.push(file).stdout)
        self.assertEqual(self.server.rows(self.database, "SELECT value FROM shaker.fact WHERE kind = 'note'"),
                         [{"value": NOTE}])

    def test_what_was_cut_off_anywhere_is_continued(self):
        whole = postgres.Proxy(self.server.port, 10**9)
        self.addCleanup(whole.end)
        self.push(self.file, port=whole.port)
        wanted, size = self.content(), whole.passed
        for part in range(1, 10):
            database = f"{self.database}_{part}"
            self.server.sql("postgres", f"CREATE DATABASE {database};")
            cut = postgres.Proxy(self.server.port, size * part // 10)
            self.addCleanup(cut.end)
            said = self.push(self.file, code=3, database=database, port=cut.port).stderr
            self.assertIn("Nothing is lost", said)
            self.push(self.file, database=database)
            self.assertEqual(self.content(database), wanted, f"cut after {part} tenths")

    def test_a_server_that_is_away_or_hangs_is_named_in_time(self):
        nobody = postgres.free_port()
        said = self.push(self.file, code=3, port=nobody).stderr
        self.assertRegex(said, rf"PostgreSQL server is away: .*port {nobody}.*Nothing is lost.*same command")
        self.server.freeze(True)
        try:
            began = time.monotonic()
            said = self.push(self.file, "--patience", "1", code=3).stderr
            self.assertLess(time.monotonic() - began, 10)
        finally:
            self.server.freeze(False)
        self.assertIn("Nothing is lost", said)
        self.push(self.file)

    def test_a_server_that_hangs_while_it_writes_is_given_up(self):
        self.push(self.file)
        self.server.sql(self.database, "DELETE FROM shaker.cycle;")
        holder = subprocess.Popen([postgres.programs() / "psql", "-X", "-q", self.server.where(self.database)],
                                  stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        holder.stdin.write("BEGIN; LOCK TABLE shaker.cycle; SELECT 'locked';\n")
        holder.stdin.flush()
        while "locked" not in holder.stdout.readline():
            pass
        said = self.push(self.file, "--patience", "1", code=3).stderr
        holder.communicate("ROLLBACK;\n")
        holder.wait(10)
        self.assertIn("said nothing for 1 s", said)
        self.push(self.file)

    def test_a_user_without_rights_is_told_who_can_help(self):
        self.server.sql(self.database, "CREATE ROLE guest LOGIN;" if not self.server.sql(
            self.database, "SELECT 1 FROM pg_roles WHERE rolname = 'guest';") else "")
        said = self.push(self.file, code=4, user="guest").stderr
        self.assertRegex(said, "permission denied.*push --print-schema")
        self.server.sql(self.database, self.call("--print-schema").stdout + """
            GRANT USAGE ON SCHEMA shaker TO guest;
            GRANT SELECT, INSERT, UPDATE ON ALL TABLES IN SCHEMA shaker TO guest;""")
        self.push(self.file, user="guest")
        self.assertEqual(self.server.rows(self.database, "SELECT complete FROM shaker.campaign"), [{"complete": True}])

    def test_tables_of_a_newer_program_are_left_alone(self):
        self.push(self.file)
        self.server.sql(self.database, "UPDATE shaker.layout SET version = 9;")
        self.assertIn("layout 9", self.push(self.file, code=4).stderr)
        self.push(self.file, "--schema", "other")
        self.assertEqual(self.server.rows(self.database, "SELECT count(*) FROM other.run"), [{"count": 1}])

    def test_a_bad_file_does_not_keep_the_others_back(self):
        mixed = self.folder / "mixed"
        mixed.mkdir()
        (mixed / "a.db").write_bytes(b"no database at all")
        shutil.copy(self.file, mixed / "b.db")
        done = self.push(mixed, "--json", code=2)
        bad, good = json.loads(done.stdout)["campaigns"]
        self.assertIn("a.db", bad["error"])
        self.assertTrue(good["complete"] and good["cycles"] > 0, good)

    def test_bad_words_are_refused(self):
        for words, said in ((["--to", "host=x password=secret"], "~/.pgpass"), (["--to", "hots=x"], "hots"),
                            (["--schema", "Robert'); DROP"], "--schema"), (["--patience", "0"], "--patience")):
            done = self.call(self.file, *words)
            self.assertEqual(done.returncode, 2, done.stderr)
            self.assertIn(said, done.stderr)
            self.assertNotIn("secret", done.stderr)
        empty = self.folder / "empty"
        empty.mkdir()
        self.assertIn("holds no campaign yet", self.push(empty).stdout)
        (empty / "campaign.json").write_text("{}")
        self.assertIn("only campaign databases", self.push(empty, code=2).stderr)

    def test_shakerctl_itself_needs_no_library_of_postgresql(self):
        needs = subprocess.run(["readelf", "-d", SHAKERCTL], capture_output=True, text=True, check=True).stdout
        self.assertIn("libsqlite3", needs)
        self.assertNotIn("libpq", needs)


if __name__ == "__main__":
    unittest.main()
