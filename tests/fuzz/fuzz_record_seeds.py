"""Writes seeds/record_*.bin: a block of samples, a log and a database as fuzz_record.cpp takes them."""
import pathlib
import sqlite3
import struct
import tempfile

SCHEMA = """
PRAGMA page_size = 512; PRAGMA application_id = 0x5348414b; PRAGMA user_version = 3;
CREATE TABLE campaign(id INTEGER PRIMARY KEY CHECK(id = 1), name TEXT NOT NULL, started_utc TEXT NOT NULL,
  rig TEXT NOT NULL, spec_json TEXT NOT NULL, model_json TEXT NOT NULL, finished_utc TEXT NOT NULL DEFAULT '',
  status TEXT NOT NULL DEFAULT 'running', crc INTEGER) STRICT;
CREATE TABLE run(idx INTEGER PRIMARY KEY, name TEXT NOT NULL, frequency_hz REAL NOT NULL, amplitude REAL NOT NULL,
  cycles_wanted INTEGER NOT NULL, crc INTEGER) STRICT;
CREATE TABLE sample(id INTEGER PRIMARY KEY, run INTEGER NOT NULL, count INTEGER NOT NULL, data BLOB NOT NULL,
  crc INTEGER) STRICT;
CREATE TABLE channel(id INTEGER PRIMARY KEY, name TEXT NOT NULL, unit TEXT NOT NULL, crc INTEGER) STRICT;
CREATE INDEX sample_by_run ON sample(run);
CREATE TABLE cycle(run INTEGER NOT NULL, idx INTEGER NOT NULL, accepted INTEGER NOT NULL, frequency_hz REAL NOT NULL,
  amplitude REAL NOT NULL, displacement BLOB NOT NULL, excitation BLOB NOT NULL,
  excitation_error REAL NOT NULL DEFAULT 0, crc INTEGER, PRIMARY KEY(run, idx)) STRICT;
CREATE TABLE document(seq INTEGER PRIMARY KEY, line TEXT NOT NULL, crc INTEGER) STRICT;
INSERT INTO campaign VALUES(1, 'c', '2026-03-01T12:00:00.000Z', 'rig', '{}', '{}', '', 'running', NULL);
INSERT INTO run VALUES(0, 'r', 2.5, 3.0, 2, NULL);
INSERT INTO document VALUES(1, '{"seq":1}', NULL);
"""

SAMPLES = b"".join(struct.pack("<qdBB", 1000 * i, 0.5 * i, i % 4, i % 3) for i in range(12))
WAVE = struct.pack("<8d", *range(8))


def database_and_log():
    with tempfile.TemporaryDirectory() as folder:
        file = pathlib.Path(folder) / "c.db"
        database = sqlite3.connect(file, isolation_level=None)
        database.executescript(SCHEMA)
        database.execute("INSERT INTO sample VALUES(1, 0, 12, ?, NULL)", (SAMPLES,))
        database.execute("INSERT INTO cycle VALUES(0, 0, 1, 2.5, 3.0, ?, ?, 0.0, NULL)", (WAVE, WAVE))
        whole = file.read_bytes()
        database.execute("PRAGMA journal_mode = WAL")
        for seq in range(2, 6):
            database.execute("INSERT INTO document VALUES(?, '{}', NULL)", (seq,))
        log = pathlib.Path(f"{file}-wal").read_bytes()
        database.close()
        return whole, log


if __name__ == "__main__":
    seeds = pathlib.Path(__file__).resolve().parent / "seeds"
    whole, log = database_and_log()
    for name, data in (("samples", b"s" + SAMPLES), ("log", b"l" + log), ("database", b"d" + whole)):
        (seeds / f"record_{name}.bin").write_bytes(data)
