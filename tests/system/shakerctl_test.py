"""The operator's own program against the real daemon."""
import json
import os
import signal
import subprocess
import time
import unittest

from daemon import CAMPAIGN, Client, Daemon, TRUTH, endless_campaign

SHAKERCTL = os.environ["SHAKERCTL"]


class Shakerctl(unittest.TestCase):
    def setUp(self):
        self.daemon = Daemon().start()
        self.addCleanup(self.daemon.end)

    def command(self, *words):
        return [SHAKERCTL, *map(str, words), "--socket", str(self.daemon.socket)]

    def run_it(self, *words):
        return subprocess.run(self.command(*words), capture_output=True, text=True, timeout=120)

    def file_of(self, campaign):
        path = self.daemon.directory / "campaign.json"
        path.write_text(json.dumps(campaign))
        return path

    def begin_endless(self):
        """shakerctl in mid-run, and a client that looks on."""
        program = subprocess.Popen(self.command("run", self.file_of(endless_campaign())), text=True,
                                   stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        self.addCleanup(lambda: (program.kill(), program.wait(), program.stdout.close(), program.stderr.close()))
        onlooker = Client(self.daemon.socket)
        self.addCleanup(onlooker.close)
        onlooker.until_state("SETTLE", timeout=60)
        return program, onlooker

    def test_runs_a_campaign_and_estimates_the_same_from_its_database(self):
        result = self.run_it("run", self.file_of(CAMPAIGN), "--json")
        self.assertEqual(result.returncode, 0, result.stderr)
        stream = [json.loads(line) for line in result.stdout.splitlines()]
        self.assertEqual(stream[0]["type"], "version")
        stops = [line["status"] for line in stream if line.get("type") == "run_stop"]
        self.assertEqual(stops, ["success", "success"])
        online = [line for line in stream if line.get("type") == "estimate"][-1]
        self.assertEqual(online["cycles_used"], 10)
        for parameter in online["parameters"]:
            truth = TRUTH[parameter["name"]]
            self.assertAlmostEqual(parameter["value"] / truth, 1.0, delta=0.02)

        shown = subprocess.run([SHAKERCTL, "show", self.daemon.databases()[0], "--json"],
                               capture_output=True, text=True, timeout=60)
        self.assertEqual(json.loads(shown.stdout)["estimate"]["seq"], online["seq"])
        offline = self.run_it("status", "--json")
        self.assertEqual(json.loads(offline.stdout)["estimate"]["seq"], online["seq"])
        result = subprocess.run([SHAKERCTL, "estimate", self.daemon.databases()[0], "--json"],
                                capture_output=True, text=True, timeout=60)
        self.assertEqual(result.returncode, 0, result.stderr)
        for mine, theirs in zip(json.loads(result.stdout)["parameters"], online["parameters"], strict=True):
            self.assertAlmostEqual(mine["value"], theirs["value"], delta=0.05 * theirs["standard_error"])
            # The accelerometer's noise is in both.
            self.assertAlmostEqual(mine["standard_error"] / theirs["standard_error"], 1.0, delta=0.02)

    def test_ctrl_c_ramps_down_and_waits_until_the_rig_is_at_rest(self):
        program, onlooker = self.begin_endless()
        program.send_signal(signal.SIGINT)
        stdout, stderr = program.communicate(timeout=60)
        self.assertEqual(program.returncode, 1, stderr)
        self.assertIn("state RAMP_DOWN", stdout)
        self.assertIn("Stopping: the rig ramps down", stderr)
        self.assertEqual(onlooker.ask("status")["result"]["state"]["state"], "IDLE")

    def test_killed_in_mid_run_the_rig_ramps_down(self):
        program, onlooker = self.begin_endless()
        program.kill()
        onlooker.until_state("RAMP_DOWN")
        onlooker.until_state("IDLE")

    def test_suspended_in_mid_run_the_lease_runs_out_and_it_says_so(self):
        program, onlooker = self.begin_endless()
        program.send_signal(signal.SIGSTOP)
        onlooker.until_state("RAMP_DOWN")
        onlooker.until_state("IDLE")
        program.send_signal(signal.SIGCONT)
        _, stderr = program.communicate(timeout=60)
        self.assertEqual(program.returncode, 1)
        self.assertIn("did not succeed", stderr)

    def test_a_second_operator_is_refused_but_may_stop(self):
        program, _ = self.begin_endless()
        second = self.run_it("run", self.file_of(CAMPAIGN))
        self.assertEqual(second.returncode, 4)
        self.assertIn("control", second.stderr)
        stop = self.run_it("stop")
        self.assertEqual(stop.returncode, 0, stop.stderr)
        _, stderr = program.communicate(timeout=60)
        self.assertEqual(program.returncode, 1, stderr)

    def test_an_emergency_stop_is_latched_until_it_is_acknowledged(self):
        program, _ = self.begin_endless()
        self.assertEqual(self.run_it("estop").returncode, 0)
        program.communicate(timeout=60)
        self.assertEqual(program.returncode, 1)
        self.assertEqual(self.run_it("status").returncode, 1)
        self.assertEqual(self.run_it("run", self.file_of(CAMPAIGN)).returncode, 4)
        # Refused, with the reason, for as long as the exciter has not yet said that it stands still.
        end = time.monotonic() + 10
        while (ack := self.run_it("ack")).returncode == 4 and time.monotonic() < end:
            self.assertIn("the exciter still reports motion", ack.stderr)
            time.sleep(0.1)
        self.assertEqual(ack.returncode, 0, ack.stderr)
        end = time.monotonic() + 10
        while (status := self.run_it("status")).returncode != 0 and time.monotonic() < end:
            time.sleep(0.1)
        self.assertEqual(status.returncode, 0, status.stdout)

    def test_watch_looks_on_without_control(self):
        program, _ = self.begin_endless()
        watch = self.run_it("watch", "--seconds", "2")
        self.assertEqual(watch.returncode, 0, watch.stderr)
        self.assertIn("on rig simulated", watch.stdout)
        self.assertIn("cycle ", watch.stdout)
        self.assertIsNone(program.poll())
