"""Motion ends: when anyone says so, and when nobody is in control."""
import signal
import time
import unittest

from daemon import Client, Daemon, endless_campaign


class Safety(unittest.TestCase):
    def setUp(self):
        self.daemon = Daemon().start()
        self.addCleanup(self.daemon.end)
        self.operator = Client(self.daemon.socket)
        self.other = Client(self.daemon.socket)
        self.operator.start(endless_campaign())
        self.operator.until_state("SETTLE", "MEASURE")
        self.mark = 0

    def until_still(self, client, *states):
        return client.until_state(*states, start=self.mark, timeout=30)

    def assert_aborted(self, client):
        stop = client.until(lambda line: line.get("type") == "run_stop", 10)
        self.assertEqual(stop["status"], "abort")
        return stop

    def test_anyone_may_stop(self):
        self.other.read()
        self.mark = len(self.other.lines)
        self.assertIn("result", self.other.ask("stop"))
        self.until_still(self.other, "RAMP_DOWN")
        self.until_still(self.other, "IDLE")
        self.assert_aborted(self.other)
        self.assertEqual(self.daemon.campaign_status(), "abort")

    def test_an_emergency_stop_latches_until_it_is_acknowledged(self):
        self.other.read()
        self.mark = len(self.other.lines)
        self.assertIn("result", self.other.ask("estop"))
        self.until_still(self.other, "FAULT")
        self.assertIn("error", self.operator.ask("campaign.start", {"campaign": endless_campaign()}))
        end = time.monotonic() + 5  # refused until the exciter itself says that it is still
        while "error" in (answer := self.other.ask("ack")) and time.monotonic() < end:
            self.assertIn("not acknowledged", answer["error"]["message"])
        self.assertIn("result", answer)
        self.until_still(self.other, "IDLE")

    def test_a_lease_that_is_not_renewed_ramps_down(self):
        self.operator.renewing = False  # the operator goes on listening, and says nothing
        state = self.until_still(self.operator, "RAMP_DOWN")
        self.assertFalse(state["controlled"])
        self.until_still(self.operator, "IDLE")

    def test_an_operator_who_goes_away_ramps_down(self):
        self.other.read()
        self.mark = len(self.other.lines)
        self.operator.close()
        self.until_still(self.other, "RAMP_DOWN")
        self.until_still(self.other, "IDLE")

    def test_sigterm_ramps_down_and_ends_with_success(self):
        self.ramps_down_at(signal.SIGTERM)

    def test_ctrl_c_ramps_down_and_ends_with_success(self):
        self.ramps_down_at(signal.SIGINT)

    def test_sigterm_gives_the_campaigns_ramp_its_time(self):
        """A ramp of 6 s where the rig's own takes 0.5 s, which is over before it."""
        self.operator.ask("stop")
        self.operator.until_state("IDLE", start=len(self.operator.lines))
        mark = len(self.operator.lines)
        self.operator.start(endless_campaign() | {"ramp_s": 6.0})
        self.operator.until_state("RAMP", start=mark)
        mark = len(self.operator.lines)
        began = time.monotonic()
        self.daemon.process.send_signal(signal.SIGTERM)
        self.operator.until_state("RAMP_DOWN", start=mark)
        self.operator.until_state("IDLE", start=mark)
        self.assertGreater(time.monotonic() - began, 5.5)
        self.assertEqual(self.daemon.process.wait(20), 0)
        self.assertNotIn("did not ramp down in time", self.daemon.log_text())

    def ramps_down_at(self, ending):
        self.other.read()
        self.mark = len(self.other.lines)
        self.daemon.process.send_signal(ending)
        self.until_still(self.other, "RAMP_DOWN")
        self.assertEqual(self.daemon.process.wait(20), 0)
        self.assertEqual(self.daemon.campaign_status(), "abort")


if __name__ == "__main__":
    unittest.main()
