"""shakerctl against a daemon that says what the test wants: other protocols, refusals, a connection that
ends. What the real daemon does is in tests/system."""
import json
import os
import pathlib
import pty
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
SHAKERCTL = os.environ["SHAKERCTL"]
CAMPAIGN = ROOT / "config" / "examples" / "campaign-demo.json"
VERSION = {"type": "version", "program": "shakerd", "version": "9.9.9", "protocol": 1, "rig": "bench"}
IDLE = {"type": "state", "state": "IDLE", "reason": "ready", "controlled": False}


def state(name, **more):
    return {"type": "state", "state": name, "reason": "", "controlled": True, **more}


def estimate(usable=True):
    return {"type": "estimate", "model": "oleo", "usable": usable, "converged": True, "cycles_used": 1,
            "runs_used": 1, "warnings": [],
            "parameters": [{"name": "theta1", "effect": "orifice_damping", "unit": "1/m", "value": 16.6671,
                            "standard_error": 0.0213, "interval": [16.62, 16.71], "fixed": False,
                            "at_bound": False, "determined": True}]}


class Daemon:
    """Serves one client: greets it with `greeting`, then answers requests by `answers[method](self)`, which
    gives the result, or raises Refusal. `full` clients before it find no place."""

    def __init__(self, path, greeting, answers=None, full=0):
        self.path, self.greeting, self.answers = path, greeting, answers or {}
        self.requests, self.full = [], full
        self.listener = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        self.listener.bind(str(path))
        self.listener.listen(1)
        self.thread = threading.Thread(target=self.serve, daemon=True)
        self.thread.start()

    def say(self, *documents):
        for document in documents:
            line = document if isinstance(document, str) else json.dumps(document)
            self.client.sendall(line.encode() + b"\n")

    def serve(self):
        try:
            for _ in range(self.full):
                self.client, _ = self.listener.accept()
                with self.client:
                    self.say({"jsonrpc": "2.0", "id": None, "error": {"code": -32000, "message": "No place."}})
            self.client, _ = self.listener.accept()
        except OSError:  # closed before anyone came
            return
        with self.client:
            try:
                self.say(*self.greeting)
                for line in self.client.makefile("rb"):
                    self.answer(json.loads(line))
            except (OSError, HangUp):
                pass

    def answer(self, request):
        self.requests.append(request)
        reply = {"jsonrpc": "2.0", "id": request["id"]}
        try:
            reply["result"] = self.answers.get(request["method"], lambda daemon: {})(self)
        except Refusal as refusal:
            reply["error"] = {"code": -32000, "message": str(refusal)}
        if reply.get("result") is not None or "error" in reply:
            self.say(reply)

    def close(self):
        if self.listener.fileno() < 0:
            return
        self.listener.shutdown(socket.SHUT_RDWR)
        self.thread.join(10)
        self.listener.close()


class Refusal(Exception):
    pass


class HangUp(Exception):
    pass


def refuse(sentence):
    def answer(_):
        raise Refusal(sentence)
    return answer


def hang_up(daemon):
    daemon.listener.close()
    raise HangUp


class Online(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.socket = pathlib.Path(folder.name) / "s"

    def serve(self, greeting=(VERSION, IDLE), answers=None, full=0):
        daemon = Daemon(self.socket, greeting, answers, full)
        self.addCleanup(daemon.close)
        return daemon

    def shakerctl(self, *words):
        return subprocess.run([SHAKERCTL, *map(str, words), "--socket", self.socket], capture_output=True,
                              text=True, timeout=60)


class Meeting(Online):
    def test_a_newer_protocol_is_3_with_the_remedy(self):
        self.serve([{**VERSION, "protocol": 2}])
        result = self.shakerctl("status")
        self.assertEqual(result.returncode, 3)
        self.assertIn("speaks protocol 2, this shakerctl 1; install the shakerctl that came with the daemon",
                      result.stderr)

    def test_something_else_that_listens_is_3(self):
        for greeting in ("HTTP/1.1 400 Bad Request", "{}", "[1]", '{"type":"version","protocol":"x"}'):
            with self.subTest(greeting=greeting):
                daemon = self.serve([greeting])
                result = self.shakerctl("status")
                self.assertEqual(result.returncode, 3)
                self.assertIn("not shakerd", result.stderr)
                daemon.close()
                self.socket.unlink()

    def test_a_refusal_in_place_of_a_greeting_is_shown(self):
        self.serve([{"jsonrpc": "2.0", "id": None, "error": {"code": -32005, "message": "16 clients are here."}}])
        result = self.shakerctl("status")
        self.assertEqual(result.returncode, 3)
        self.assertIn("16 clients are here.", result.stderr)

    def test_no_permission_says_which_group(self):
        if os.geteuid() == 0:
            command = ["setpriv", "--reuid", "65534", "--regid", "65534", "--clear-groups"]
            if subprocess.run([*command, SHAKERCTL, "--version"], capture_output=True).returncode != 0:
                self.skipTest("the program cannot be run as nobody here")
        else:
            command = []
        self.serve()
        self.socket.parent.chmod(0o755)
        self.socket.chmod(0o000)
        result = subprocess.run([*command, SHAKERCTL, "status", "--socket", self.socket],
                                capture_output=True, text=True, timeout=60)
        self.assertEqual(result.returncode, 3)
        self.assertIn("permission denied; be a member of the group shaker", result.stderr)


class Orders(Online):
    def test_status_shows_state_and_the_last_estimate(self):
        answers = {"status": lambda _: {"state": state("MEASURE", campaign="demo", run="slow", progress=0.5),
                                        "in_control": False}}
        self.serve([VERSION, IDLE, estimate()], answers)
        result = self.shakerctl("status")
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertIn("rig bench   shakerd 9.9.9\nstate MEASURE\ncampaign demo, run slow, 50 % done\n",
                      result.stdout)
        self.assertIn("16.667 ± 0.021", result.stdout)

    def test_status_shows_alarms_and_who_is_in_control(self):
        alarm = {"type": "alarm", "severity": "error", "code": "estop", "t_utc": "2026-03-01T12:34:56.000Z",
                 "text": "the rig was stopped"}
        answers = {"status": lambda _: {"state": state("IDLE"), "in_control": False,
                                        "controller": "anna (pid 7)", "controlled_for_s": 65.0}}
        daemon = self.serve([VERSION, IDLE, alarm], answers)
        result = self.shakerctl("status")
        self.assertIn("ALARM since 2026-03-01 12:34:56 UTC: the rig was stopped\n", result.stdout)
        self.assertIn("control: anna (pid 7), for 1 min 05 s\n", result.stdout)
        daemon.close()
        self.socket.unlink()
        self.serve([VERSION, IDLE, alarm], answers)
        shown = json.loads(self.shakerctl("status", "--json").stdout)
        self.assertEqual(shown["alarms"], [alarm])
        self.assertEqual(shown["controller"], "anna (pid 7)")

    def test_status_in_fault_is_1(self):
        self.serve(answers={"status": lambda _: {"state": state("FAULT"), "in_control": False}})
        result = self.shakerctl("status", "--json")
        self.assertEqual(result.returncode, 1)
        self.assertEqual(json.loads(result.stdout)["state"]["state"], "FAULT")

    def test_orders_are_sent_and_refusals_are_4(self):
        for method in ("stop", "pause", "estop", "ack"):
            with self.subTest(method=method):
                daemon = self.serve(answers={method: lambda _: {"state": "RAMP_DOWN"}})
                result = self.shakerctl(method)
                self.assertEqual(result.returncode, 0, result.stderr)
                self.assertIn("State: RAMP_DOWN.", result.stdout)
                self.assertEqual([each["method"] for each in daemon.requests], [method])
                daemon.close()
                self.socket.unlink()
        self.serve(answers={"ack": refuse("The stroke is still outside of its limits.")})
        result = self.shakerctl("ack")
        self.assertEqual(result.returncode, 4)
        self.assertIn("the daemon refuses: The stroke is still outside", result.stderr)

    def test_a_stop_is_asked_again_until_there_is_a_place(self):
        daemon = self.serve(answers={"estop": lambda _: {"state": "FAULT"}}, full=5)
        result = self.shakerctl("estop")
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertEqual([each["method"] for each in daemon.requests], ["estop"])

    def test_a_stop_that_finds_no_place_for_5_s_says_so(self):
        self.serve(full=10**6)
        result = self.shakerctl("stop")
        self.assertEqual(result.returncode, 3)
        self.assertIn("No place.", result.stderr)

    def test_a_stop_at_rest_says_that_nothing_was_moving(self):
        for name in ("IDLE", "FAULT"):
            daemon = self.serve(answers={"stop": lambda _, name=name: {"state": name}})
            self.assertEqual(self.shakerctl("stop").stdout, f"Nothing was moving. State: {name}.\n")
            daemon.close()
            self.socket.unlink()

    def test_a_daemon_that_goes_away_is_3(self):
        self.serve(answers={"stop": hang_up})
        result = self.shakerctl("stop")
        self.assertEqual(result.returncode, 3)
        self.assertIn("journalctl -u shakerd", result.stderr)


class Watch(Online):
    def test_tells_a_line_for_each_document(self):
        self.serve([VERSION, IDLE, state("RAMP"), state("RAMP", progress=0.1), estimate(), {"type": "health", "state": "RAMP"}])
        result = self.shakerctl("watch", "--seconds", 1)
        self.assertEqual(result.returncode, 0, result.stderr)
        lines = [line.strip() for line in result.stdout.splitlines()]
        self.assertEqual(lines, ["shakerd 9.9.9 on rig bench", "state IDLE: ready", "state RAMP",
                                 "estimate from 1 cycle: theta1 16.667 ± 0.021"])

    def on_a_terminal(self, seconds, meanwhile=lambda: None):
        """What `watch` writes to a terminal; `meanwhile` is called once it has drawn something."""
        master, terminal = os.openpty()
        program = subprocess.Popen([SHAKERCTL, "watch", "--seconds", str(seconds), "--socket", self.socket],
                                   stdout=terminal, stderr=subprocess.PIPE)
        os.close(terminal)
        screen = b""
        try:
            while chunk := os.read(master, 65536):
                screen += chunk
                meanwhile, once = (lambda: None), meanwhile
                once()
        except OSError:  # the terminal's other end is closed
            pass
        os.close(master)
        self.assertEqual(program.wait(30), 0, program.stderr.read())
        program.stderr.close()
        return screen.decode()

    def test_draws_a_table_on_a_terminal_and_gives_the_screen_back(self):
        health = {"type": "health", "state": "MEASURE", "channels": [
            {"channel": "displacement", "quality": "good", "value": 0.125, "unit": "m", "rate_hz": 1000.2, "age_s": 0.004},
            {"channel": "aux1", "name": "gas_pressure", "quality": "good", "value": 981234.0, "unit": "Pa", "rate_hz": 100, "age_s": 0.01}]}
        self.serve([VERSION, state("MEASURE", progress=0.5, eta_s=65), health, estimate()])
        screen = self.on_a_terminal(1)
        self.assertIn("\x1b[?1049h", screen)
        self.assertRegex(screen, r"displacement +good +125 +mm +1000 +4")
        self.assertRegex(screen, r"gas_pressure +good +9\.8123e\+05 +Pa +100 +10")
        self.assertIn("[###############...............]  50 %   ETA 1 min 05 s", screen)
        self.assertIn("16.667 ± 0.021", screen[screen.rindex("\x1b[?1049l"):])

    def test_an_alarm_rings_and_is_the_first_that_one_sees(self):
        self.serve([VERSION, state("FAULT"), {"type": "alarm", "severity": "error", "code": "emergency_stop",
                                              "t_utc": "2026-03-01T12:34:56.000Z", "text": "the rig was stopped"}])
        screen = self.on_a_terminal(1)
        self.assertIn("\a", screen)
        self.assertIn("\x1b[1;7;31mALARM since 12:34:56 UTC: the rig was stopped", screen)

    def test_asks_for_a_daemon_that_has_gone_until_it_is_back(self):
        first = self.serve([VERSION, IDLE], answers={})

        def restart():
            first.client.shutdown(socket.SHUT_RDWR)
            first.close()
            self.socket.unlink()
            threading.Timer(0.6, lambda: self.serve([dict(VERSION, rig="again"), IDLE])).start()
        screen = self.on_a_terminal(4, restart)
        self.assertIn("NO CONNECTION", screen)
        self.assertIn("on rig again", screen[screen.rindex("NO CONNECTION"):])

    def test_json_is_the_stream_itself(self):
        self.serve([VERSION, IDLE])
        result = self.shakerctl("watch", "--seconds", 1, "--json")
        self.assertEqual(list(map(json.loads, result.stdout.splitlines())), [VERSION, IDLE])


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
