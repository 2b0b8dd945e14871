"""A drive whose heartbeat timeout cannot be read must prove that it comes to rest by itself."""
import copy
import json
import os
import re
import subprocess
import unittest

from daemon import Client, Daemon, SOURCE, endless_campaign


class Deadman(unittest.TestCase):
    def start(self, timeout_s):
        """The virtual rig with that timeout of its own, and a daemon that cannot read it."""
        virtual = subprocess.Popen(
            [os.environ["OLEOSIM"], "--port", "0", "--heartbeat-timeout", str(timeout_s)],
            stdout=subprocess.PIPE, text=True)
        self.addCleanup(virtual.wait)
        self.addCleanup(virtual.kill)
        self.addCleanup(virtual.stdout.close)
        port = re.search(r"port=(\d+)", virtual.stdout.readline()).group(1)
        text = (SOURCE / "config" / "examples" / "rig-oleosim-modbus.json").read_text()
        rig = json.loads(re.sub(r"^\s*//.*$", "", text, flags=re.M).replace("1502", port))
        rig["limits"] |= {"stale_s": 0.5, "engine_stall_s": 2.0, "acquisition_stall_s": 5.0, "recorder_stall_s": 10.0}
        rig["exciter"]["deadman_max_s"] = 2.0
        del rig["exciter"]["device"]["registers"]["heartbeat_timeout"]
        self.daemon = Daemon(rig).start()
        self.addCleanup(self.daemon.end)
        self.client = Client(self.daemon.socket)
        self.addCleanup(self.client.close)

    def alarm(self, code, timeout=20):
        return self.client.until(lambda line: line.get("code") == code, timeout)

    def test_proves_it_at_rest_and_remembers(self):
        self.start(0.5)
        self.client.start(endless_campaign())
        self.assertIn("acts at rest", self.alarm("deadman_proved")["text"])
        self.client.until_state("RAMP", timeout=20)
        kept = json.loads((self.daemon.data / "deadman-proof.json").read_text())
        self.assertEqual(kept["how"], "at rest")
        self.assertGreater(kept["seconds"], 0.1)
        self.assertIn("pid", kept["user"])
        self.assertRegex(kept["date"], r"^\d{4}-\d\d-\d\dT")

    def test_refuses_a_drive_without_one(self):
        self.start(0)
        self.client.start(endless_campaign())
        self.assertIn("is not proved", self.alarm("deadman_unproven")["text"])
        self.client.until_state("IDLE", timeout=20)
        self.assertFalse([s for s in self.client.of_type("state") if s["state"] == "RAMP"])

    def test_an_operator_proves_it_in_motion(self):
        self.start(0.5)
        done = subprocess.run(
            [os.environ["SHAKERCTL"], "prove-deadman", "--socket", str(self.daemon.socket), "--frequency", "5",
             "--amplitude", "0.5"], capture_output=True, text=True, timeout=60)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        self.assertIn("dead-man acts in motion", done.stdout)
        kept = json.loads((self.daemon.data / "deadman-proof.json").read_text())
        self.assertEqual(kept["how"], "in motion")
        self.assertIn("deadman-proof", self.daemon.databases()[0].name)
        self.client.start(copy.deepcopy(endless_campaign()))
        self.client.until_state("RAMP", timeout=20)
        self.assertEqual(len([a for a in self.client.of_type("alarm") if a["code"] == "deadman_proved"]), 1)


if __name__ == "__main__":
    unittest.main()
