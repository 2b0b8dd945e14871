"""A damper whose gas begins to leak in mid-run, seen by the running daemon."""
import copy
import json
import unittest

from daemon import CAMPAIGN, Client, Daemon, RIG, Schemas


class Change(unittest.TestCase):
    def test_a_leak_is_an_alarm_with_the_parameter_and_the_cycle(self):
        rig = copy.deepcopy(RIG)
        rig["sensors"][0]["parameters"].update(gas_leak=2e-3, leak_opens=9.0)
        campaign = dict(copy.deepcopy(CAMPAIGN), name="watched", forgetting=0.95,
                        change_detection={"false_alarms_per_run": 0.01})
        campaign["runs"] = [{"name": "dwell", "frequency_hz": 4.0, "amplitude": 4.0, "cycles": 500}]
        daemon = Daemon(rig).start()
        self.addCleanup(daemon.end)
        client = Client(daemon.socket)
        self.addCleanup(client.close)
        client.start(campaign)
        alarm = client.until(lambda line: line.get("code") == "parameter_change", 60)
        self.assertIn("theta2", [alarm["parameter"], *alarm.get("alternatives", [])])
        self.assertLess(alarm["value"] + 3 * alarm["standard_error"], 0.0)
        self.assertIn("alone explains it" if alarm["alone"] else "alone", alarm["text"])
        self.assertEqual(alarm["run"], "dwell")
        self.assertEqual(alarm["severity"], "warning")
        last = max(line["cycle"] for line in client.of_type("cycle"))
        self.assertLessEqual(alarm["cycle"], last)
        self.assertGreater(alarm["cycle"], last - 30)
        self.assertIn("result", client.ask("stop"))
        client.until_state("IDLE", start=len(client.lines) - 1)
        schemas = Schemas()
        for line in client.lines:
            self.assertEqual(schemas.faults(line), [], json.dumps(line)[:500])
        # The running estimate forgets: it never counts more than 1 / (1 - 0.95) cycles.
        self.assertLessEqual(max(line["cycles_used"] for line in client.of_type("estimate")), 20)


if __name__ == "__main__":
    unittest.main()
