"""Whatever a client sends, it gets a clear answer, and nobody else notices."""
import contextlib
import os
import re
import socket
import subprocess
import time
import unittest

from daemon import CAMPAIGN, Client, Daemon, Schemas, endless_campaign


class Requests(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.daemon = Daemon(tcp=0).start()
        cls.addClassCleanup(cls.daemon.end)
        cls.schemas = Schemas()

    def setUp(self):
        self.client = Client(self.daemon.socket)
        self.addCleanup(self.client.close)

    def error_after(self, data):
        start = len(self.client.lines)
        self.client.send(data)
        answer = self.client.until(lambda line: "error" in line, 10, start)
        self.assertEqual(self.schemas.faults(answer), [])
        self.assertIn("result", self.client.ask("ping"))  # the connection has survived
        return answer["error"]["code"], answer["error"]["message"]

    def test_a_huge_line(self):
        code, message = self.error_after(b"x" * 1_000_000 + b"\n")
        self.assertEqual(code, -32003)
        self.assertIn("65536", message)

    def test_deep_nesting(self):
        code, message = self.error_after(b"[" * 50_000 + b"\n")
        self.assertEqual(code, -32700)
        self.assertIn("nested deeper than 32", message)

    def test_invalid_utf8(self):
        code, message = self.error_after(b'{"jsonrpc":"2.0","id":1,"method":"\xff\xfe"}\n')
        self.assertEqual(code, -32700)
        self.assertIn("UTF-8", message)

    def test_not_json(self):
        self.assertEqual(self.error_after(b"hello\n")[0], -32700)

    def test_a_batch(self):
        code, message = self.error_after(b'[{"jsonrpc":"2.0","id":1,"method":"ping"}]\n')
        self.assertEqual(code, -32600)
        self.assertIn("one request a line", message)

    def test_an_unknown_method(self):
        answer = self.client.ask("launch")
        self.assertEqual(answer["error"]["code"], -32601)
        self.assertIn("campaign.start", answer["error"]["message"])

    def test_start_without_the_lease(self):
        answer = self.client.ask("campaign.start", {"campaign": CAMPAIGN})
        self.assertEqual(answer["error"]["code"], -32001)

    def test_a_bad_campaign_names_the_place_and_changes_nothing(self):
        self.client.ask("control.acquire")
        for key, value in (("runs", []), ("surprise", 1), ("name", 3)):
            answer = self.client.ask("campaign.start", {"campaign": dict(CAMPAIGN, **{key: value})})
            self.assertEqual(answer["error"]["code"], -32602, answer)
            self.assertIn(key, answer["error"]["message"])
        self.assertEqual(self.client.ask("status")["result"]["state"]["state"], "IDLE")
        self.client.ask("control.release")

    def test_a_model_that_cannot_be_built_moves_nothing(self):
        """A client's own request, past shakerctl: what no schema sees is found before the table moves."""
        self.client.ask("control.acquire")
        for wrong, effect in (("magic", {"effect": "magic"}),
                              ("theta9", {"effect": "gas_spring", "parameters": {"theta9": {"start": 1.0}}})):
            model = {"name": "m", "effects": [effect, {"effect": "gravity"}]}
            answer = self.client.ask("campaign.start", {"campaign": dict(CAMPAIGN, model=model)})
            self.assertEqual(answer["error"]["code"], -32602, answer)
            self.assertIn(wrong, answer["error"]["message"])
        self.assertEqual(self.client.ask("status")["result"]["state"]["state"], "IDLE")
        self.assertEqual([line for line in self.client.lines if line.get("state") == "CHECK"], [])
        self.client.ask("control.release")

    def test_a_setpoint_beyond_the_limits_is_refused(self):
        campaign = endless_campaign()
        campaign["runs"][0]["frequency_hz"] = 500.0
        self.client.ask("control.acquire")
        answer = self.client.ask("campaign.start", {"campaign": campaign})
        self.assertIn("error", answer)
        self.assertIn("500", answer["error"]["message"])
        self.client.ask("control.release")

    def test_a_client_that_does_not_read_its_answers_waits_and_loses_none(self):
        flood = Client(self.daemon.socket)
        self.addCleanup(flood.close)
        request = b'{"jsonrpc":"2.0","id":1,"method":"status"}\n' * 1000
        flood.socket.settimeout(1)
        sent = 0
        with self.assertRaises(TimeoutError):
            while sent < 10_000_000:  # what is not read in the daemon is not taken from it either
                sent += flood.socket.send(request[sent % len(request):])
        self.assertIn("result", self.client.ask("ping"))
        rest = request[sent % len(request):]  # of a line, and of a thousand
        wanted = (sent + len(rest)) // len(request) * 1000
        end = time.monotonic() + 20
        while sum("result" in line for line in flood.lines) < wanted and time.monotonic() < end:
            with contextlib.suppress(TimeoutError):
                rest = rest[flood.socket.send(rest):] if rest else rest
            flood.read()
        self.assertEqual(sum("result" in line for line in flood.lines), wanted)

    def test_stop_and_estop_find_a_place_whoever_is_there(self):
        daemon = Daemon(tcp=0).start()
        self.addCleanup(daemon.end)
        daemon.until_logged("Clients listen on 127.0.0.1:")
        port = int(re.search(r"listen on 127\.0\.0\.1:(\d+)", daemon.log_text())[1])
        with contextlib.ExitStack() as held:
            for _ in range(20):
                held.enter_context(socket.create_connection(("127.0.0.1", port)))
            for _ in range(200):
                held.enter_context(contextlib.closing(Client(daemon.socket)))
            for command, state in (("stop", "IDLE"), ("estop", "FAULT")):
                with self.subTest(command):
                    asked = subprocess.run([os.environ["SHAKERCTL"], command, "--socket", str(daemon.socket)],
                                           capture_output=True, text=True, timeout=20)
                    self.assertNotEqual(asked.returncode, 3, asked.stderr)  # 3: no daemon, or no place
                    look = held.enter_context(contextlib.closing(Client(daemon.socket)))
                    self.assertEqual(look.ask("status")["result"]["state"]["state"], state)


if __name__ == "__main__":
    unittest.main()
