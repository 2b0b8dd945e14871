"""shakerd-mqtt between the real daemon and a real mosquitto: late subscribers, and all that can be away or hang."""
import json
import os
import pathlib
import shutil
import signal
import subprocess
import tempfile
import time
import unittest

from daemon import RIG, Client, Daemon, endless_campaign
from mqtt_client import PROGRAM, Broker, Subscriber

SHAKERD_MQTT = os.environ["SHAKERD_MQTT"]
BASE = "shaker/simulated/"
ADDED = {"age_s", "ages_s", "alarms_standing", "dropped_before"}
SOON = 2.0  # what the bridge promises for its end, s


def quick_campaign():
    """Endless; at this frequency the first estimate comes after 3 s."""
    campaign = endless_campaign()
    campaign["runs"][0]["frequency_hz"] = 8.0
    return campaign


def is_bridge(word):
    return lambda message: message.kind == "bridge" and message.payload == word


def as_written(message):
    """The daemon's own document in a message."""
    return {key: value for key, value in json.loads(message.payload).items() if key not in ADDED}


class Bridge:
    def __init__(self, broker, view, *words):
        self.words = [SHAKERD_MQTT, "--socket", str(view), "--broker", "127.0.0.1", "--port", str(broker.port), *words]
        self.log = tempfile.TemporaryFile("w+")

    def start(self):
        self.process = subprocess.Popen(self.words, stderr=self.log)
        return self

    def said(self):
        self.log.seek(0)
        return self.log.read()

    def until_said(self, sentence, timeout=10):
        end = time.monotonic() + timeout
        while sentence not in self.said():
            if time.monotonic() > end:
                raise AssertionError(f"{sentence!r} was not said:\n{self.said()}")
            time.sleep(0.02)

    def ask_to_end(self):
        """Status, and the seconds until then."""
        began = time.monotonic()
        self.process.send_signal(signal.SIGTERM)
        return self.process.wait(15), time.monotonic() - began

    def end(self):
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGCONT)
            self.process.kill()
            self.process.wait()
        self.log.close()


@unittest.skipUnless(PROGRAM, "there is no mosquitto: the bridge to a broker is not tried")
class World(unittest.TestCase):
    """A broker, a daemon with a view socket, and the bridge between them."""

    def setUp(self):
        self.daemon = Daemon()
        self.addCleanup(self.daemon.end)
        self.view = self.daemon.directory / "view.sock"
        self.daemon.more += ["--view-socket", str(self.view)]
        self.daemon.start()
        self.broker = Broker().start()
        self.addCleanup(self.broker.end)

    def bridge(self, *words, broker=None):
        bridge = Bridge(broker or self.broker, self.view, *words).start()
        self.addCleanup(bridge.end)
        return bridge

    def subscriber(self):
        subscriber = Subscriber(self.broker.port)
        self.addCleanup(subscriber.close)
        return subscriber

    def operator(self):
        client = Client(self.daemon.socket)
        self.addCleanup(client.close)
        return client


class Documents(World):
    def test_a_late_subscriber_gets_what_there_is_and_how_old_it_is(self):
        self.bridge()
        operator = self.operator()
        operator.start(quick_campaign())
        operator.until(lambda line: line.get("type") == "estimate", 45)
        operator.ask("estop")
        operator.until_state("FAULT")
        early = self.subscriber()
        early.until(lambda m: m.kind == "health" and "emergency_stop" in m.payload)
        end = time.monotonic() + 1.1
        while time.monotonic() < end:
            operator.read()
        late = self.subscriber()
        for kind in ("bridge", "state", "estimate", "alarm", "health"):
            message = late.until(lambda m, kind=kind: m.kind == kind)
            self.assertEqual((message.topic, message.retained, message.qos), (BASE + kind, True, 1))
        self.assertEqual({m.topic for m in late.messages},
                         {BASE + kind for kind in ("bridge", "state", "estimate", "alarm", "health")})
        self.assertEqual(late.of_kind("bridge")[0].payload, "online")
        for kind in ("state", "estimate", "alarm"):
            message = late.of_kind(kind)[0]
            self.assertEqual(as_written(message), operator.of_type(kind)[-1], kind)
            document = json.loads(message.payload)
            self.assertTrue(0 <= document["age_s"] < 1, document["age_s"])
        # A health is renewed each second, and has the age of the others.
        message = late.of_kind("health")[0]
        health = json.loads(message.payload)
        operator.until(lambda line: line.get("seq") == health["seq"] and "jsonrpc" not in line)
        self.assertIn(as_written(message), operator.of_type("health"))
        for kind in ("state", "estimate", "alarm"):
            age = (health["t_mono_ns"] - operator.of_type(kind)[-1]["t_mono_ns"]) / 1e9 + health["age_s"]
            self.assertLess(abs(health["ages_s"][kind] - age), 2e-3, kind)
            self.assertGreater(age, 0.5)
        self.assertIn(("emergency_stop", "error"), [(a["code"], a["severity"]) for a in health["alarms_standing"]])
        deadline = time.monotonic() + 20
        while "error" in operator.ask("ack") and time.monotonic() < deadline:
            time.sleep(0.2)
        late.until(lambda m: m.kind == "alarm" and json.loads(m.payload)["code"] == "acknowledged")
        late.until(lambda m: m.kind == "health" and json.loads(m.payload)["seq"] > health["seq"]
                   and json.loads(m.payload)["alarms_standing"] == [])


class Away(World):
    def test_what_came_while_the_broker_was_away_is_sent_when_it_is_back(self):
        bridge = self.bridge()
        operator = self.operator()
        self.subscriber().until(lambda m: m.kind == "health")
        self.broker.kill()
        bridge.until_said("no connection to the broker")
        operator.ask("estop")
        operator.until_state("FAULT")
        deadline = time.monotonic() + 20
        while "error" in operator.ask("ack") and time.monotonic() < deadline:
            time.sleep(0.2)
        before = len(operator.lines)
        operator.until(lambda line: line.get("type") == "health", start=before)
        bridge.process.send_signal(signal.SIGSTOP)  # so that the subscriber is there first
        self.broker.start()
        subscriber = self.subscriber()
        self.assertEqual(subscriber.messages, [], "the broker was to forget")
        bridge.process.send_signal(signal.SIGCONT)
        subscriber.until(lambda m: m.kind == "health", 15)
        self.assertEqual(subscriber.messages[0].payload, "online")
        operator.read()
        alarms = operator.of_type("alarm")
        self.assertGreaterEqual(len(alarms), 2)
        self.assertEqual([as_written(m) for m in subscriber.of_kind("alarm")], alarms, "every alarm, in order")
        ages = [json.loads(m.payload)["age_s"] for m in subscriber.of_kind("alarm")]
        self.assertEqual(ages, sorted(ages, reverse=True))
        for message, alarm in zip(subscriber.of_kind("alarm"), alarms):
            age = message.at - alarm["t_mono_ns"] / 1e9
            self.assertLess(abs(json.loads(message.payload)["age_s"] - age), 0.5)
        self.assertEqual(as_written(subscriber.of_kind("state")[0]), operator.of_type("state")[-1])

    def test_a_daemon_that_is_lost_is_told(self):
        bridge = self.bridge("--rig", "simulated")
        subscriber = self.subscriber()
        subscriber.until(is_bridge("online"))
        subscriber.until(lambda m: m.kind == "health")
        killed = time.monotonic()
        self.daemon.kill()
        self.assertLess(subscriber.until(is_bridge("daemon_lost")).at - killed, 1)
        late = self.subscriber()
        self.assertEqual(late.until(lambda m: m.kind == "bridge").payload, "daemon_lost")
        self.assertEqual(json.loads(late.until(lambda m: m.kind == "state").payload)["state"], "IDLE")
        self.assertEqual(bridge.ask_to_end()[0], 0)
        late.until(is_bridge("offline"))
        again = self.bridge("--rig", "simulated")  # there is no daemon yet
        again.until_said("there is no daemon")
        new = self.subscriber()
        new.until(is_bridge("daemon_lost"))
        self.daemon.start()
        new.until(is_bridge("online"), 15)

    def test_a_rig_with_another_name_gets_topics_of_its_own(self):
        bridge = self.bridge()
        subscriber = self.subscriber()
        subscriber.until(lambda m: m.kind == "health")
        self.daemon.kill()
        self.daemon.rig_file.write_text(json.dumps(RIG | {"name": "hall 3/two"}))
        self.daemon.start()
        subscriber.until(lambda m: m.topic == "shaker/hall_3_two/health")
        late = self.subscriber()
        late.until(lambda m: m.topic == "shaker/hall_3_two/health")
        self.assertEqual({m.topic: m.payload for m in late.of_kind("bridge")},
                         {BASE + "bridge": "offline", "shaker/hall_3_two/bridge": "online"})
        self.assertEqual(bridge.ask_to_end()[0], 0)


class Ends(World):
    def test_asked_to_end_it_says_so_and_ends(self):
        bridge = self.bridge()
        subscriber = self.subscriber()
        subscriber.until(is_bridge("online"))
        status, took = bridge.ask_to_end()
        self.assertEqual(status, 0, bridge.said())
        self.assertLess(took, SOON)
        subscriber.until(is_bridge("offline"), 1)
        self.assertEqual(self.subscriber().until(lambda m: m.kind == "bridge").payload, "offline")

    def test_the_broker_says_it_of_one_that_was_killed(self):
        bridge = self.bridge()
        subscriber = self.subscriber()
        subscriber.until(is_bridge("online"))
        bridge.process.kill()
        subscriber.until(is_bridge("offline"), 2)
        self.assertEqual(self.subscriber().until(lambda m: m.kind == "bridge").payload, "offline")

    def test_a_broker_that_hangs_holds_up_neither_the_daemon_nor_the_end(self):
        bridge = self.bridge()
        operator = self.operator()
        operator.start(quick_campaign())
        operator.until_state("MEASURE")
        self.subscriber().until(lambda m: m.kind == "estimate", 20)
        self.broker.signal(signal.SIGSTOP)
        self.addCleanup(self.broker.signal, signal.SIGCONT)
        before, end, slowest = len(operator.lines), time.monotonic() + 2, 0.0
        while time.monotonic() < end:
            asked = time.monotonic()
            operator.ask("lease.renew")
            slowest = max(slowest, time.monotonic() - asked)
            time.sleep(0.05)
        new = operator.lines[before:]
        self.assertLess(slowest, 0.5)
        self.assertGreater(len([line for line in new if line.get("type") == "estimate"]), 4)
        self.assertFalse([line for line in new if line.get("type") == "alarm"])
        late = [line["loop_late_max_s"] for line in new if line.get("type") == "health" and "loop_late_max_s" in line]
        self.assertLess(max(late), 0.5)
        status, took = bridge.ask_to_end()
        self.assertEqual(status, 0, bridge.said())
        self.assertLess(took, SOON)
        self.daemon.kill()  # quicker than a ramp
        self.broker.signal(signal.SIGCONT)
        # The connection ended without a goodbye: the broker publishes the will.
        self.subscriber().until(is_bridge("offline"), 5)

    def test_a_daemon_that_hangs_is_told_and_it_ends_when_the_broker_hangs_too(self):
        bridge = self.bridge()
        subscriber = self.subscriber()
        subscriber.until(is_bridge("online"))
        self.addCleanup(self.daemon.process.send_signal, signal.SIGCONT)
        self.daemon.process.send_signal(signal.SIGSTOP)
        subscriber.until(is_bridge("daemon_lost"), 6)
        self.assertIn("shakerd has said nothing", bridge.said())
        self.addCleanup(self.broker.signal, signal.SIGCONT)
        self.broker.signal(signal.SIGSTOP)
        time.sleep(1)  # it waits for the daemon's greeting
        status, took = bridge.ask_to_end()
        self.assertEqual(status, 0, bridge.said())
        self.assertLess(took, SOON)


def make_certificate(key, certificate):
    subprocess.run(["openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1", "-nodes",
                    "-keyout", key, "-out", certificate, "-days", "2", "-subj", "/CN=localhost",
                    "-addext", "subjectAltName=DNS:localhost,IP:127.0.0.1"], check=True, capture_output=True)


class Options(unittest.TestCase):
    def test_what_makes_no_sense_is_refused_with_one_sentence(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        open_file = pathlib.Path(folder.name) / "open"
        open_file.write_text("secret\n")
        open_file.chmod(0o644)
        for words, sentence in (
                (["--port", "0"], "--port"), (["--port", "99999"], "--port"), (["--broker", ""], "--broker"),
                (["--prefix", "a/#"], "--prefix \"a/#\" is no prefix"), (["--rig", "a b"], "write \"a_b\""),
                (["--password-file", str(open_file)], "--user"),
                (["--user", "u", "--password-file", str(open_file)], "chmod o-r"),
                (["--user", "u", "--password-file", "/nowhere"], "No such file"),
                (["--ca-file", "/nowhere.pem"], "--ca-file /nowhere.pem: No such file"),
                (["--commands"], "--commands")):
            done = subprocess.run([SHAKERD_MQTT, *words], capture_output=True, text=True, timeout=10)
            self.assertEqual(done.returncode, 2, words)
            self.assertIn(sentence, done.stderr, words)
            lines = [line for line in done.stderr.splitlines() if line and not line.startswith("Run with --help")]
            self.assertEqual(len(lines), 1, done.stderr)

    @unittest.skipUnless(PROGRAM, "there is no mosquitto")
    def test_names_are_those_that_were_asked_for(self):
        broker = Broker().start()
        self.addCleanup(broker.end)
        bridge = Bridge(broker, "/nowhere/view.sock", "--prefix", "hall-3/rigs", "--rig", "two").start()
        self.addCleanup(bridge.end)
        subscriber = Subscriber(broker.port)
        self.addCleanup(subscriber.close)
        subscriber.until(lambda m: (m.topic, m.payload) == ("hall-3/rigs/two/bridge", "daemon_lost"))

    @unittest.skipUnless(PROGRAM and shutil.which("openssl"), "there is no mosquitto or no openssl")
    def test_passwords_and_tls(self):
        folder = pathlib.Path(tempfile.mkdtemp(prefix="tls."))
        self.addCleanup(shutil.rmtree, folder)
        certificate, key, password = folder / "own.pem", folder / "own.key", folder / "password"
        make_certificate(key, certificate)
        subprocess.run(["mosquitto_passwd", "-b", "-c", str(folder / "users"), "rig", "open sesame"], check=True,
                       capture_output=True)
        password.write_text("open sesame\n")
        password.chmod(0o600)
        broker = Broker(f"certfile {certificate}", f"keyfile {key}", f"password_file {folder / 'users'}").start()
        self.addCleanup(broker.end)

        def bridge(*words):
            one = Bridge(broker, "/nowhere/view.sock", "--rig", "one", *words).start()
            self.addCleanup(one.end)
            return one

        right = ("--user", "rig", "--password-file", str(password), "--ca-file", str(certificate))
        bridge(*right).until_said("answers")
        password.write_text("wrong\n")
        wrong = bridge(*right)
        wrong.until_said("check --user and --password-file")
        self.assertNotIn("wrong\n", wrong.said())
        other = folder / "other.pem"
        make_certificate(folder / "other.key", other)
        bridge("--ca-file", str(other)).until_said("check --ca-file")


if __name__ == "__main__":
    unittest.main()
