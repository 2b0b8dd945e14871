"""Whatever a client sends, it gets a clear answer, and nobody else notices."""
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

    def test_a_setpoint_beyond_the_limits_is_refused(self):
        campaign = endless_campaign()
        campaign["runs"][0]["frequency_hz"] = 500.0
        self.client.ask("control.acquire")
        answer = self.client.ask("campaign.start", {"campaign": campaign})
        self.assertIn("error", answer)
        self.assertIn("500", answer["error"]["message"])
        self.client.ask("control.release")

    def test_a_client_that_never_reads_is_told_what_it_missed_then_dropped(self):
        slow = Client(self.daemon.socket)
        self.addCleanup(slow.close)
        request = b'{"jsonrpc":"2.0","id":1,"method":"status"}\n' * 1000
        slow.socket.settimeout(5)
        sent = 0
        try:
            for _ in range(200):  # the answers fill its buffers
                slow.send(request)
                sent += 1000
        except (TimeoutError, BrokenPipeError, ConnectionResetError):
            pass
        while not slow.closed:
            slow.read(5)
        last = slow.of_type("missed")
        if last:  # it was quick enough to be told
            self.assertEqual(slow.lines[-1], last[-1])
            self.assertEqual(self.schemas.faults(last[-1]), [])
            self.assertGreater(last[-1]["count"], 0)
        self.daemon.until_logged("read too slowly")
        self.assertIn("result", self.client.ask("ping"))

    def test_the_seventeenth_client_is_told(self):
        clients = [Client(self.daemon.socket) for _ in range(16)]
        try:
            first = clients[-1].until(lambda line: True, 5)
            self.assertEqual(first["error"]["code"], -32005)
        finally:
            for client in clients:
                client.close()


if __name__ == "__main__":
    unittest.main()
