"""shakerctl against a daemon that says what the test wants: other protocols, refusals, a connection that
ends. What the real daemon does is in tests/system."""
import json
import os
import socket
import subprocess
import sys
import threading
import unittest

from scripted_daemon import SHAKERCTL, VERSION, IDLE, state, estimate, Daemon, refuse, hang_up, Online


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


class Service(Online):
    """The sockets of the service. systemd holds both; the one that commands stays when the daemon is stopped."""

    def setUp(self):
        super().setUp()
        root = self.socket.parent
        self.socket, self.view = root / "shakerd" / "left" / "shakerd.sock", root / "shakerd-view" / "left" / "view.sock"
        for path in (self.socket, self.view):
            path.parent.mkdir(parents=True)
        # As systemd has it: whoever connects would start the daemon.
        self.commanding = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        self.addCleanup(self.commanding.close)
        self.commanding.bind(str(self.socket))
        self.commanding.listen(8)
        self.commanding.setblocking(False)

    def view_daemon(self, rig):
        daemon = Daemon(self.view, [dict(VERSION, rig=rig), IDLE])
        self.addCleanup(daemon.close)
        return daemon

    def assert_nobody_came(self):
        with self.assertRaises(BlockingIOError):
            self.commanding.accept()

    def test_watch_uses_the_view_socket_and_does_not_start_a_daemon_that_was_stopped(self):
        first = self.view_daemon("first")

        def stopped():  # the socket's file stays, and nobody listens
            first.client.shutdown(socket.SHUT_RDWR)
            first.close()
            threading.Timer(0.8, again).start()

        def again():
            self.view.unlink()
            self.view_daemon("second")
        screen = self.on_a_terminal(4, stopped)
        self.assertIn("on rig first", screen)
        self.assertIn("NO CONNECTION", screen)
        self.assertIn("on rig second", screen[screen.rindex("NO CONNECTION"):])
        self.assert_nobody_came()

    def test_watch_of_a_stopped_daemon_says_so_and_starts_nothing(self):
        self.view_daemon("first").close()
        result = self.shakerctl("watch", "--seconds", 1)
        self.assertEqual(result.returncode, 3)
        self.assertIn("the daemon is stopped", result.stderr)
        self.assert_nobody_came()

    def test_who_may_not_look_there_watches_where_one_commands_while_the_daemon_runs(self):
        if os.geteuid() != 0:
            self.skipTest("only root can be somebody without permission here")
        command = ["setpriv", "--reuid", "65534", "--regid", "65534", "--clear-groups", SHAKERCTL, "watch", "--seconds",
                   "1", "--socket", self.socket]
        if subprocess.run([*command[:6], SHAKERCTL, "--version"], capture_output=True).returncode != 0:
            self.skipTest("the program cannot be run as nobody here")
        daemon = self.view_daemon("first")
        for path in (self.view.parents[2], self.socket):
            path.chmod(0o777)
        self.view.chmod(0o600)
        program = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
        self.commanding.settimeout(20)
        client, _ = self.commanding.accept()
        with client:
            client.sendall(b"".join(json.dumps(line).encode() + b"\n" for line in (VERSION, IDLE)))
            self.assertIn("on rig bench", program.communicate(timeout=20)[0])
        daemon.close()
        result = subprocess.run(command, capture_output=True, text=True, timeout=20)
        self.assertEqual(result.returncode, 3, result.stderr)
        self.commanding.setblocking(False)
        self.assert_nobody_came()


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


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], "-v"])
