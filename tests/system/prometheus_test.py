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
from gateway_world import World
from rigs_test import Several

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

    def get(self, path, **words):
        """The data of an answer; None while it is not there yet."""
        address = f"http://127.0.0.1:{self.port}/api/v1/{path}?" + urllib.parse.urlencode(words)
        try:
            with urllib.request.urlopen(address, timeout=10) as answer:
                return json.load(answer)["data"]
        except urllib.error.HTTPError as refusal:
            if refusal.code == 503:  # it begins
                return None
            raise AssertionError(f"{words}: {refusal.read().decode()}") from None
        except (urllib.error.URLError, ConnectionError):
            return None

    def ask(self, expression):
        """The samples, as pairs of labels and number; nothing while there are none."""
        data = self.get("query", query=expression)
        return [(one["metric"], float(one["value"][1])) for one in data["result"]] if data else []

    def choices(self, query):
        """What Grafana offers for the query of a variable, label_values(SERIES, LABEL)."""
        series, label = re.fullmatch(r"label_values\((.*), (\w+)\)", query).groups()
        return self.get(f"label/{label}/values", **{"match[]": series}) or []

    def end(self):
        self.process.kill()
        self.process.wait()
        with contextlib.suppress(OSError):
            shutil.rmtree(self.folder)


DASHBOARD = json.loads((SOURCE / "gateway" / "grafana-dashboard.json").read_text())
VARIABLES = {one["name"]: one for one in DASHBOARD["templating"]["list"]}


def queries(rig):
    """Every query of the dashboard, as Grafana would send it."""
    for panel in DASHBOARD["panels"]:
        for target in panel["targets"]:
            yield panel["title"], target["expr"].replace("$job", JOB).replace("$rig", rig).replace("$__rate_interval", "4s")


def answers(prometheus, operator, rig):
    """Title, query and samples of each query, once it has some; waits up to 20 s for each."""
    for title, expression in queries(rig):
        end = time.monotonic() + 20
        while not (samples := prometheus.ask(expression)) and time.monotonic() < end:
            operator.ask("lease.renew")
            time.sleep(0.2)
        yield title, expression, samples


@unittest.skipUnless(PROGRAM, "there is no prometheus: the dashboard's queries are not tried")
class Dashboard(World):
    def test_every_query_has_an_answer_while_a_campaign_measures(self):
        prometheus = Prometheus(self.gateway.port)
        self.addCleanup(prometheus.end)
        operator = self.operator()
        operator.start(endless_campaign())
        operator.until(lambda line: line.get("type") == "estimate" and line["cycles_used"] >= 3, 45)
        seen = set()
        for title, expression, samples in answers(prometheus, operator, VARIABLES["rig"]["allValue"]):
            self.assertTrue(samples, f"{title}: {expression}")
            seen |= set(re.findall(r"shaker_\w+", expression))
        state = prometheus.ask(f'shaker_state{{job="{JOB}"}} == 1')
        self.assertEqual([labels["state"] for labels, _ in state], ["MEASURE"])
        shown = {re.match(r"\w+", line).group(0) for line in self.gateway.get("/metrics")[2].decode().splitlines()
                 if not line.startswith("#")}
        self.assertEqual(seen - shown, set())


@unittest.skipUnless(PROGRAM, "there is no prometheus: the dashboard's queries are not tried")
class DashboardOfSeveral(Several):
    def test_one_of_several_rigs_is_chosen(self):
        for name in ("left", "right"):
            self.daemon(name)
        prometheus = Prometheus(self.gateway().port)
        self.addCleanup(prometheus.end)
        operator = self.operator("left")
        operator.start(endless_campaign())
        operator.until(lambda line: line.get("type") == "estimate" and line["cycles_used"] >= 3, 45)
        for title, expression, samples in answers(prometheus, operator, "left"):
            self.assertTrue(samples, f"{title}: {expression}")
            self.assertEqual({labels.get("rig", "left") for labels, _ in samples}, {"left"}, expression)
        self.assertEqual(prometheus.choices(VARIABLES["rig"]["query"].replace("$job", JOB)), ["left", "right"])
        self.assertEqual(prometheus.choices(VARIABLES["job"]["query"]), [JOB])
        states = prometheus.ask(dict(queries(VARIABLES["rig"]["allValue"]))["State"])
        self.assertEqual({labels["rig"]: labels["state"] for labels, _ in states}, {"left": "MEASURE", "right": "IDLE"})


if __name__ == "__main__":
    unittest.main()
