"""wave, scope and rig: documents for those who look on, from the real daemon."""
import pathlib
import tempfile
import threading
import unittest

from daemon import CAMPAIGN, Client, Daemon, RIG, Schemas

EXTRA = {"wave", "scope", "rig"}


class Onlookers(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.view = pathlib.Path(folder.name) / "view.sock"
        cls.daemon = Daemon(**{"view-socket": cls.view}).start()
        cls.addClassCleanup(cls.daemon.end)
        cls.operator = Client(cls.daemon.socket)
        cls.onlooker = Client(cls.view)
        cls.answer = cls.onlooker.ask("subscribe", {"documents": sorted(EXTRA)})
        cls.refusal = cls.onlooker.ask("stop")
        reading = threading.Event()
        reader = threading.Thread(target=lambda: [cls.onlooker.read() for _ in iter(reading.is_set, True)])
        reader.start()  # who does not read is left out
        cls.operator.until_state("IDLE")
        before = len(cls.operator.lines)
        cls.operator.start({**CAMPAIGN, "specimen": {"serial": "N-042", "charge": "18 bar"}})
        cls.operator.until_state("IDLE", start=before, timeout=60)
        cls.operator.renewing = False
        reading.set()
        reader.join()
        last = cls.operator.lines[-1].get("seq")
        cls.onlooker.until(lambda line: line.get("seq") == last, 5)
        cls.operator.close()
        cls.onlooker.until(lambda line: line.get("type") == "rig" and "in_control" not in line
                           and line["seq"] >= last, 10)

    def test_every_line_is_valid(self):
        schemas = Schemas()
        for line in self.onlooker.lines:
            self.assertEqual(schemas.faults(line), [], str(line)[:400])
        self.assertLessEqual(EXTRA, {line.get("type") for line in self.onlooker.lines})

    def test_who_did_not_ask_sees_nothing_new_and_no_gap(self):
        self.assertFalse(EXTRA & {line.get("type") for line in self.operator.lines})
        for client in (self.operator, self.onlooker):
            numbered = [line["seq"] for line in client.lines
                        if "seq" in line and line["type"] not in EXTRA | {"version"}]
            live = numbered[numbered.index(max(numbered[0], client.lines[0]["seq"] + 1)):] \
                if client.lines[0]["seq"] + 1 in numbered else numbered
            self.assertEqual(live, list(range(live[0], live[0] + len(live))))

    def test_a_wave_comes_for_each_whole_cycle(self):
        waves = {(w["run_index"], w["cycle"]): w for w in self.onlooker.of_type("wave")}
        runs = [run["name"] for run in CAMPAIGN["runs"]]
        accepted = {(runs.index(c["run"]), c["cycle"]) for c in self.operator.of_type("cycle")
                    if c["accepted"]}
        self.assertLessEqual(accepted, set(waves))
        cycles = {(runs.index(c["run"]), c["cycle"]): c for c in self.operator.of_type("cycle")}
        for key, wave in waves.items():
            self.assertEqual(wave["accepted"], cycles[key]["accepted"])
            self.assertEqual(len(wave["stroke_m"]), 64)
            self.assertEqual(len(wave["excitation_m_s2"]), 64)
            self.assertLess(abs(max(wave["stroke_m"]) - cycles[key]["stroke_max_m"]), 1e-3)
        last = waves[max(accepted)]
        # The model is the rig's own: it runs through the measured points.
        worst = max(abs(a - b) for a, b in zip(last["stroke_m"], last["response_m"]))
        self.assertLess(worst, 3e-4)
        swing = max(last["stroke_m"]) - min(last["stroke_m"])
        self.assertLess(worst, 0.02 * swing)
        self.assertLess(max(map(abs, last["missing_force_m_s2"])), 1.0)

    def test_the_scope_shows_every_20_ms_of_each_channel(self):
        scopes = self.onlooker.of_type("scope")
        seconds = (scopes[-1]["t_mono_ns"] - scopes[0]["t_mono_ns"]) / 1e9
        self.assertGreater(len(scopes), 7 * seconds)
        self.assertLess(len(scopes), 11 * seconds + 2)
        bins = [b for s in scopes for c in s["channels"] if c["channel"] == "displacement"
                for b in c["bin"]]
        self.assertEqual(bins, sorted(set(bins)))
        self.assertGreater(len(bins), 0.8 * (bins[-1] - bins[0]))
        low = min(v for s in scopes for c in s["channels"] if c["channel"] == "excitation" for v in c["min"])
        high = max(v for s in scopes for c in s["channels"] if c["channel"] == "excitation" for v in c["max"])
        self.assertLess(low, -2.5)
        self.assertGreater(high, 2.5)

    def test_the_rig_has_its_limits_and_says_who_is_in_control(self):
        rigs = self.onlooker.of_type("rig")
        self.assertEqual(rigs[0]["stroke_max_m"], RIG["limits"]["stroke_max_m"])
        self.assertEqual([c["channel"] for c in rigs[0]["channels"]], ["displacement", "excitation"])
        self.assertIn("pid", next(r["in_control"] for r in rigs if "in_control" in r))
        self.assertNotIn("in_control", rigs[-1])
        self.assertNotIn("plan", rigs[0])
        self.assertEqual([(run["frequency_hz"], run["cycles_wanted"]) for run in rigs[-1]["plan"]["runs"]],
                         [(run["frequency_hz"], run["cycles"]) for run in CAMPAIGN["runs"]])
        self.assertEqual(rigs[-1]["plan"]["specimen"], {"serial": "N-042", "charge": "18 bar"})

    def test_the_view_socket_cannot_command(self):
        self.assertEqual(self.answer["result"]["documents"], sorted(EXTRA))
        self.assertEqual(self.refusal["error"]["code"], -32004)
        self.assertEqual(self.view.stat().st_mode & 0o777, 0o660)


if __name__ == "__main__":
    unittest.main()
