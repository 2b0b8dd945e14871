"""Every query of the Grafana dashboard, by Debian's Prometheus that scrapes the gateway while a campaign measures."""
import contextlib
import json
import pathlib
import re
import shutil
import socket
import subprocess
import tempfile
import time
import unittest
import urllib.error
import urllib.parse
import urllib.request

from daemon import SOURCE, endless_campaign
from page_test import World

PROGRAM = shutil.which("prometheus")
JOB = "shaker"


class Prometheus:
    def __init__(self, target):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="prometheus."))
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            self.port = free.getsockname()[1]
        (self.folder / "conf.yml").write_text(
            f"global: {{scrape_interval: 1s}}\nscrape_configs:\n"
            f"  - {{job_name: {JOB}, static_configs: [{{targets: ['127.0.0.1:{target}']}}]}}\n")
        self.process = subprocess.Popen(
            [PROGRAM, f"--config.file={self.folder}/conf.yml", f"--storage.tsdb.path={self.folder}/data",
             f"--web.listen-address=127.0.0.1:{self.port}"], stderr=open(self.folder / "log", "ab"), cwd=self.folder)

    def ask(self, expression):
        """The samples, as pairs of labels and number; nothing while it is not there yet."""
        address = f"http://127.0.0.1:{self.port}/api/v1/query?" + urllib.parse.urlencode({"query": expression})
        try:
            with urllib.request.urlopen(address, timeout=10) as answer:
                return [(one["metric"], float(one["value"][1])) for one in json.load(answer)["data"]["result"]]
        except urllib.error.HTTPError as refusal:
            if refusal.code == 503:  # it begins
                return []
            raise AssertionError(f"{expression}: {refusal.read().decode()}") from None
        except (urllib.error.URLError, ConnectionError):
            return []


    def end(self):
        self.process.kill()
        self.process.wait()
        with contextlib.suppress(OSError):
            shutil.rmtree(self.folder)


def queries():
    """Every query of the dashboard, as Grafana would send it."""
    dashboard = json.loads((SOURCE / "gateway" / "grafana-dashboard.json").read_text())
    for panel in dashboard["panels"]:
        for target in panel["targets"]:
            yield panel["title"], target["expr"].replace("$job", JOB).replace("$__rate_interval", "4s")


@unittest.skipUnless(PROGRAM, "there is no prometheus: the dashboard's queries are not tried")
class Dashboard(World):
    def test_every_query_has_an_answer_while_a_campaign_measures(self):
        prometheus = Prometheus(self.gateway.port)
        self.addCleanup(prometheus.end)
        operator = self.operator()
        operator.start(endless_campaign())
        operator.until(lambda line: line.get("type") == "estimate" and line["cycles_used"] >= 3, 45)
        seen = set()
        for title, expression in queries():
            end = time.monotonic() + 20
            while not (samples := prometheus.ask(expression)) and time.monotonic() < end:
                operator.ask("lease.renew")
                time.sleep(0.2)
            self.assertTrue(samples, f"{title}: {expression}")
            seen |= set(re.findall(r"shaker_\w+", expression))
        state = prometheus.ask(f'shaker_state{{job="{JOB}"}} == 1')
        self.assertEqual([labels["state"] for labels, _ in state], ["MEASURE"])
        shown = {re.match(r"\w+", line).group(0) for line in self.gateway.get("/metrics")[2].decode().splitlines()
                 if not line.startswith("#")}
        self.assertEqual(seen - shown, set())


if __name__ == "__main__":
    unittest.main()
