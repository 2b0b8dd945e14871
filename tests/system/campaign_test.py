"""A campaign of two short runs, watched by its operator and by one who joins late."""
import json
import sqlite3
import statistics
import unittest

from daemon import CAMPAIGN, Client, Daemon, Schemas, TRUTH


class Campaign(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.daemon = Daemon().start()
        cls.addClassCleanup(cls.daemon.end)
        cls.schemas = Schemas()
        cls.client = Client(cls.daemon.socket)
        cls.client.until(lambda line: line.get("type") == "state")
        before = len(cls.client.lines)
        cls.client.start(CAMPAIGN)
        cls.client.until(lambda line: line.get("type") == "estimate", 45)
        cls.late = Client(cls.daemon.socket)
        cls.client.until(lambda line: line.get("type") == "run_stop" and line["run"] == "fast", 45)
        cls.client.until_state("IDLE", start=before)
        cls.late.until(lambda line: line.get("seq") == cls.client.lines[-1].get("seq"), 5)
        cls.client.renewing = False

    def test_the_first_line_is_the_version_then_the_state(self):
        self.assertEqual([line["type"] for line in self.client.lines[:2]], ["version", "state"])
        self.assertEqual(self.client.lines[0]["rig"], "simulated")
        self.assertEqual(self.client.lines[1]["state"], "IDLE")

    def test_every_line_is_valid(self):
        for client in (self.client, self.late):
            for line in client.lines:
                self.assertEqual(self.schemas.faults(line), [], json.dumps(line)[:500])
        seen = {line.get("type") for line in self.client.lines}
        self.assertLessEqual({"version", "state", "run_start", "cycle", "estimate", "health",
                              "run_stop"}, seen)

    def test_the_sequence_has_no_gap(self):
        live = [line["seq"] for line in self.client.lines[1:] if "seq" in line]
        snapshot = sum(line["seq"] <= self.client.lines[0]["seq"] for line in self.client.lines[1:]
                       if "seq" in line)
        live = live[snapshot:]
        first = self.client.lines[0]["seq"] + 1
        self.assertEqual(live, list(range(first, first + len(live))))

    def test_exactly_one_estimate_for_each_accepted_cycle(self):
        cycles = [(c["run"], c["cycle"]) for c in self.client.of_type("cycle") if c["accepted"]]
        estimates = [(e["run"], e["cycle"]) for e in self.client.of_type("estimate")]
        self.assertEqual(estimates, cycles)
        self.assertEqual(len(cycles), sum(run["cycles"] for run in CAMPAIGN["runs"]))

    def test_runs_start_and_end_in_order(self):
        events = [(line["type"], line["run"], line.get("status")) for line in self.client.lines
                  if line.get("type") in ("run_start", "run_stop")]
        self.assertEqual(events, [("run_start", "slow", None), ("run_stop", "slow", "success"),
                                  ("run_start", "fast", None), ("run_stop", "fast", "success")])

    def test_the_last_estimate_finds_the_truth(self):
        last = self.client.of_type("estimate")[-1]
        self.assertTrue(last["usable"], last)
        for parameter in last["parameters"]:
            if parameter["name"] in TRUTH:
                low, high = parameter["interval"]
                width = high - low
                truth = TRUTH[parameter["name"]]
                self.assertGreater(truth, low - width, parameter)
                self.assertLess(truth, high + width, parameter)

    def test_a_late_joiner_gets_version_state_and_last_estimate_then_everything(self):
        self.assertEqual([line["type"] for line in self.late.lines[:3]],
                         ["version", "state", "estimate"])
        joined = self.late.lines[0]["seq"]
        rest = [raw for raw, line in zip(self.late.raw[3:], self.late.lines[3:])]
        same = [raw for raw, line in zip(self.client.raw, self.client.lines)
                if line.get("seq", 0) > joined and line["type"] != "version"]
        self.assertEqual(rest, same[:len(rest)])

    def test_everything_seen_is_in_the_database(self):
        status = self.daemon.campaign_status()
        [file] = self.daemon.databases()
        with sqlite3.connect(file) as database:
            kept = {line for (line,) in database.execute("SELECT line FROM document")}
            cycles, = database.execute("SELECT count(*) FROM cycle WHERE accepted").fetchone()
            samples, = database.execute("SELECT sum(count) FROM sample").fetchone()
        for raw, line in zip(self.client.raw, self.client.lines):
            if line.get("type") in ("run_start", "cycle", "estimate", "run_stop"):
                self.assertIn(raw, kept)
        self.assertEqual(status, "success")
        self.assertEqual(cycles, len(self.client.of_type("estimate")))
        self.assertGreater(samples, 5000)  # two channels at 1 kHz for some seconds

    def test_an_estimate_is_quick(self):
        """Not a gate on time, which belongs to a rig PC: the table in docs/protocol_limits.md is from here."""
        computed, flushed = [], []
        for line, came in zip(self.client.lines, self.client.times):
            if line.get("type") == "estimate":
                computed.append(line["latency_s"] * 1e3)
                flushed.append((came - line["t_mono_ns"]) / 1e6)
        print(f"\nlast sample to estimate: median {statistics.median(computed):.3f} ms, "
              f"worst {max(computed):.3f} ms; then to the client, with the disk's flush: "
              f"median {statistics.median(flushed):.3f} ms, worst {max(flushed):.3f} ms")
        self.assertLess(statistics.median(computed), 50)


if __name__ == "__main__":
    unittest.main()
