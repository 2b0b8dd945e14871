"""`shakerctl run` and `resume` against a daemon that says what the test wants."""
import os
import pty
import signal
import subprocess
import sys
import threading
import unittest

from scripted_daemon import CAMPAIGN, SHAKERCTL, VERSION, IDLE, state, estimate, Refusal, HangUp, refuse, hang_up, Online


def play(end_state="IDLE", last="success", usable=True):
    """A campaign of the demo's two runs, all at once."""
    def answer(daemon):
        daemon.say(state("CHECK"))
        for index, name in enumerate(("slow", "fast")):
            stop = {"type": "run_stop", "run": name, "status": "success" if index == 0 else last,
                    "cycles_accepted": 1, "cycles_rejected": 0, "reason": ""}
            daemon.say({"type": "run_start", "run": name, "run_index": index, "run_count": 2, "frequency_hz": 2,
                        "amplitude": 3, "cycles_wanted": 8}, state("MEASURE"),
                       {"type": "cycle", "run": name, "cycle": index, "accepted": True}, estimate(usable), stop)
        daemon.say(state("RAMP_DOWN"), state(end_state, reason="at rest"))
        return {"state": "CHECK"}
    return answer


class Run(Online):
    def run_campaign(self, *words, **answers):
        answers = {name.replace("_", "."): each for name, each in answers.items()}
        daemon = self.serve(answers={"control.acquire": lambda _: {"lease_s": 0.2}, **answers})
        return daemon, self.shakerctl("run", CAMPAIGN, *words)

    def test_a_campaign_that_succeeds_is_0(self):
        daemon, result = self.run_campaign(campaign_start=play())
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertIn("run 1 of 2, slow: 2 Hz", result.stdout)
        self.assertIn("16.667 ± 0.021", result.stdout)
        self.assertTrue(result.stdout.endswith("The campaign is done.\n"))
        methods = [each["method"] for each in daemon.requests]
        self.assertEqual(methods[:2], ["control.acquire", "campaign.start"])
        campaign = daemon.requests[1]["params"]["campaign"]
        self.assertEqual(campaign["model"]["effects"][0]["effect"], "orifice_damping")
        self.assertEqual(len(campaign["runs"]), 2)

    def test_quiet_leaves_out_the_lines_of_cycles_and_estimates(self):
        _, result = self.run_campaign("--quiet", campaign_start=play())
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertNotIn("estimate from", result.stdout)
        self.assertNotIn("cycle 0 of", result.stdout)
        self.assertIn("run 2 of 2, fast: 2 Hz", result.stdout)
        self.assertIn("run fast: success", result.stdout)
        self.assertIn("16.667 ± 0.021", result.stdout)
        self.assertTrue(result.stdout.endswith("The campaign is done.\n"))

    def test_a_run_that_fails_is_1_and_says_why(self):
        _, result = self.run_campaign(campaign_start=play(last="fail"))
        self.assertEqual(result.returncode, 1)
        self.assertIn("the campaign did not succeed: at rest", result.stderr)

    def test_a_campaign_that_ends_early_says_how_to_measure_the_rest(self):
        def begin(daemon):
            return {**play(last="abort")(daemon), "database": "/data/demo_1.db"}
        _, result = self.run_campaign(campaign_start=begin)
        self.assertEqual(result.returncode, 1)
        self.assertIn("at rest; measure the rest with `shakerctl run --resume /data/demo_1.db`", result.stderr)

    def test_a_campaign_file_or_databases_are_needed_and_not_both(self):
        self.assertIn("give a campaign file, or --resume FILE.db", self.shakerctl("run").stderr)
        both = self.shakerctl("run", CAMPAIGN, "--resume", "x.db")
        self.assertEqual(both.returncode, 2)
        for bad, why in (("serial", "give KEY=TEXT"), ("charge=18", "no number with a unit"),
                         ("seriel=7", 'did you mean "serial"?')):
            result = self.shakerctl("run", CAMPAIGN, "--specimen", bad)
            self.assertEqual(result.returncode, 2)
            self.assertIn(why, result.stderr)

    def test_a_fault_is_1(self):
        _, result = self.run_campaign(campaign_start=play(end_state="FAULT"))
        self.assertEqual(result.returncode, 1)

    def test_an_estimate_that_is_not_usable_is_5(self):
        _, result = self.run_campaign(campaign_start=play(usable=False))
        self.assertEqual(result.returncode, 5)

    def test_refusals_are_4(self):
        _, result = self.run_campaign(control_acquire=refuse("Another client is in control."))
        self.assertEqual(result.returncode, 4)
        self.assertIn("Another client is in control.", result.stderr)

    def test_a_daemon_that_dies_in_mid_run_is_3(self):
        def die(daemon):
            daemon.say(state("CHECK"), state("MEASURE"))
            daemon.say({"jsonrpc": "2.0", "id": 2, "result": {"state": "CHECK"}})
            raise HangUp
        _, result = self.run_campaign(campaign_start=die)
        self.assertEqual(result.returncode, 3)
        self.assertIn("shakerd closed the connection", result.stderr)

    def test_keeps_the_lease_and_ramps_down_at_ctrl_c(self):
        renewed, stopped = threading.Event(), threading.Event()

        def begin(daemon):
            daemon.say(state("CHECK"), state("MEASURE"))
            return {"state": "CHECK"}

        def stop(daemon):
            stopped.set()
            daemon.say(state("RAMP_DOWN"), {"type": "run_stop", "run": "slow", "status": "abort", "reason": "stop",
                                            "cycles_accepted": 0, "cycles_rejected": 0},
                       state("IDLE", reason="stopped by its operator"))
            return {"state": "RAMP_DOWN"}

        def renew(daemon):
            if sum(each["method"] == "lease.renew" for each in daemon.requests) >= 3:
                renewed.set()
            return {"lease_s": 0.2}

        self.serve(answers={"control.acquire": lambda _: {"lease_s": 0.2}, "campaign.start": begin, "stop": stop,
                            "lease.renew": renew})
        program = subprocess.Popen([SHAKERCTL, "run", CAMPAIGN, "--socket", self.socket], text=True,
                                   stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        self.assertTrue(renewed.wait(30))
        self.assertFalse(stopped.is_set())
        program.send_signal(signal.SIGINT)
        _, stderr = program.communicate(timeout=30)
        self.assertTrue(stopped.is_set())
        self.assertEqual(program.returncode, 1)
        self.assertIn("the rig ramps down", stderr)
        self.assertIn("stopped by its operator", stderr)

    def resume(self, **answers):
        daemon = self.serve([VERSION, state("PAUSE")], {"control.acquire": lambda _: {"lease_s": 0.2}, **answers})
        return daemon, self.shakerctl("resume")

    def test_resume_takes_control_and_stays_until_the_rig_is_at_rest(self):
        def go_on(status):
            def answer(daemon):
                daemon.say(state("CHECK", reason="resumed by otto"))

                def end():
                    daemon.say(state("MEASURE"), {"type": "run_stop", "run": "fast", "status": status, "reason": "",
                                                  "cycles_accepted": 1, "cycles_rejected": 0},
                               state("RAMP_DOWN"), state("IDLE", reason="at rest"))
                threading.Timer(0.5, end).start()
                return {"state": "CHECK"}
            return answer
        daemon, result = self.resume(resume=go_on("success"))
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertIn("state CHECK: resumed by otto\n", result.stdout)
        methods = [each["method"] for each in daemon.requests]
        self.assertEqual(methods[:2], ["control.acquire", "resume"])
        self.assertIn("lease.renew", methods)
        daemon.close()
        self.socket.unlink()
        _, result = self.resume(resume=go_on("fail"))
        self.assertEqual(result.returncode, 1)
        self.assertIn("the campaign did not succeed: at rest", result.stderr)

    def test_resume_that_is_refused_is_4(self):
        _, result = self.resume(resume=refuse("the rig is in IDLE; nothing is paused"))
        self.assertEqual(result.returncode, 4)
        self.assertIn("nothing is paused", result.stderr)

    def test_keys_pause_and_resume_a_run(self):
        asked = {"pause": threading.Event(), "resume": threading.Event()}

        def begin(daemon):
            daemon.say(state("CHECK"), state("MEASURE"))
            return {"state": "CHECK"}

        def heed(method):
            def answer(daemon):
                asked[method].set()
                if method == "resume":
                    raise Refusal("the rig is in MEASURE; nothing is paused")
                return {"state": "RAMP_DOWN"}
            return answer
        self.serve(answers={"control.acquire": lambda _: {"lease_s": 2}, "campaign.start": begin,
                            "pause": heed("pause"), "resume": heed("resume"), "stop": hang_up})
        pid, terminal = pty.fork()
        if pid == 0:
            os.execv(SHAKERCTL, [SHAKERCTL, "run", str(CAMPAIGN), "--socket", str(self.socket)])
        os.write(terminal, b"p")
        self.assertTrue(asked["pause"].wait(30))
        os.write(terminal, b"xr")
        self.assertTrue(asked["resume"].wait(30))
        os.kill(pid, signal.SIGINT)
        screen = b""
        try:
            while chunk := os.read(terminal, 65536):
                screen += chunk
        except OSError:  # the terminal's other end is closed
            pass
        os.close(terminal)
        self.assertEqual(os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1]), 3)
        self.assertIn("nothing is paused", screen.decode())

    def test_a_bad_campaign_never_reaches_the_daemon(self):
        daemon = self.serve()
        bad = self.socket.parent / "bad.json"
        bad.write_text('{"name": "c", "model": {"name": "m", "effects": [{"effect": "magic"}]}, '
                       '"runs": [{"frequency_hz": 2, "amplitude": 3}]}')
        result = self.shakerctl("run", bad)
        self.assertEqual(result.returncode, 2)
        self.assertIn("magic", result.stderr)
        self.assertEqual(daemon.requests, [])


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], "-v"])
