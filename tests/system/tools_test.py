"""The shell examples of docs/protocol*.md, run as they stand there (with this test's socket)."""
import json
import os
import re
import signal
import subprocess
import threading
import time
import unittest

from daemon import Client, Daemon, SOURCE, endless_campaign

DOCUMENT = (SOURCE / "docs" / "protocol.md").read_text()
# A fenced block ```sh whose first line says, as a comment, what its output must contain.
EXAMPLES = re.findall(r"```sh\n# prints: (.*)\n((?:.*\n)*?)```",
                      DOCUMENT + (SOURCE / "docs" / "protocol_onlookers.md").read_text())


class Tools(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.daemon = Daemon().start()
        cls.addClassCleanup(cls.daemon.end)

    def test_the_document_has_examples(self):
        self.assertGreaterEqual(len(EXAMPLES), 5)

    def test_each_example_prints_what_it_says(self):
        operator = Client(self.daemon.socket)
        operator.start(endless_campaign())
        operator.until(lambda line: line.get("type") == "estimate", 45)
        for expected, script in EXAMPLES:
            with self.subTest(script):
                process = subprocess.Popen(
                    ["bash", "-c", script.replace("/run/shakerd/shakerd.sock", str(self.daemon.socket))],
                    stdout=subprocess.PIPE, stderr=subprocess.PIPE, stdin=subprocess.DEVNULL, text=True)
                end = time.monotonic() + 20
                while process.poll() is None and time.monotonic() < end:
                    if operator.renewing:
                        operator.send({"jsonrpc": "2.0", "method": "lease.renew"})
                    operator.read(0.2)
                self.assertIsNotNone(process.poll(), "the example does not end")
                out, err = process.communicate()
                self.assertRegex(out, expected, err)

    def test_a_campaign_from_a_shell_runs_to_its_end(self):
        script = re.findall(r"```sh\n(\(echo (?:.*\n)*?)```", DOCUMENT)[-1]
        daemon = Daemon().start()
        self.addCleanup(daemon.end)
        campaign = daemon.directory / "campaign.json"
        spec = endless_campaign()
        spec["runs"][0]["cycles"] = 3
        campaign.write_text(json.dumps(spec))
        script = script.replace("/run/shakerd/shakerd.sock", str(daemon.socket))
        self.assertIn("/etc/shakerd/campaign.json", script)
        script = script.replace("/etc/shakerd/campaign.json", str(campaign))
        process = subprocess.Popen(["bash", "-c", script], stdout=subprocess.PIPE, text=True,
                                   stdin=subprocess.DEVNULL, start_new_session=True)
        watchdog = threading.Timer(60, os.killpg, (process.pid, signal.SIGKILL))
        watchdog.start()
        kinds = []
        for text in process.stdout:
            document = json.loads(text)
            kinds.append(document.get("type"))
            if kinds[-1] == "run_stop":
                self.assertEqual(document["status"], "success", document)
                break
        watchdog.cancel()
        os.killpg(process.pid, signal.SIGKILL)
        process.wait()
        process.stdout.close()
        self.assertIn("estimate", kinds)
        self.assertEqual(kinds[-1], "run_stop")
        self.assertNotIn("health", kinds)


if __name__ == "__main__":
    unittest.main()
