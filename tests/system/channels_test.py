"""A load cell and an accelerometer on the wire: recorded, and diagnosed from, by the daemon."""
import copy
import json
import os
import re
import subprocess
import unittest

from daemon import CAMPAIGN, Client, Daemon, SOURCE

MASS = 500.0  # of the virtual rig, kg
FRICTION = 0.3
INPUT = {"excitation": (8, "f32", "m/s^2"), "timestamp": (10, "u32", "us"), "aux1": (12, "u32", "1"),
         "aux2": (14, "f32", "Pa"), "aux3": (16, "f32", "degC"), "force": (18, "f32", "N"),
         "acceleration": (20, "f32", "m/s^2")}


def rig(port):
    """The example's, with all that the virtual rig offers up to the accelerometer of its mass."""
    text = (SOURCE / "config" / "examples" / "rig-oleosim-modbus.json").read_text()
    made = json.loads(re.sub(r"^\s*//.*$", "", text, flags=re.M).replace("1502", str(port)))
    made["model"] = str(SOURCE / "config" / "examples" / "model-oleo.json")
    made["limits"] |= {"stale_s": 0.5, "engine_stall_s": 2.0, "acquisition_stall_s": 5.0, "recorder_stall_s": 10.0}
    made["exciter"]["deadman_max_s"] = 2.0
    for name, (address, form, unit) in INPUT.items():
        register = {"table": "input", "address": address, "type": form}
        made["sensors"][0]["registers"][name] = register if name == "aux1" else {**register, "unit": unit}
    made["auxiliary"] = {"aux1": {"name": "counter", "unit": "1"}, "aux2": {"name": "gas_pressure", "unit": "Pa"},
                         "aux3": {"name": "oil_temperature", "unit": "degC"}}
    return made


def campaign():
    spec = copy.deepcopy(CAMPAIGN)
    spec["name"] = "all channels"
    spec["reference_mass"] = MASS
    # A cycle is refused for a gap longer than a step of its grid: the steps are wide, for a machine that is busy.
    spec["points_per_cycle"] = 20
    spec["runs"] = [{"name": "slow", "frequency_hz": 1.6, "amplitude": 3.0, "cycles": 8},
                    {"name": "fast", "frequency_hz": 2.8, "amplitude": 5.0, "cycles": 10}]
    return spec


class Channels(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.virtual = subprocess.Popen(
            [os.environ["OLEOSIM"], "--port", "0", "--param", f"coulomb_friction={FRICTION}",
             "--heartbeat-timeout", "2"], stdout=subprocess.PIPE, text=True)
        cls.addClassCleanup(cls.end_virtual)
        port = int(re.search(r"port=(\d+)", cls.virtual.stdout.readline()).group(1))
        cls.daemon = Daemon(rig(port)).start()
        cls.addClassCleanup(cls.daemon.end)
        cls.client = Client(cls.daemon.socket)
        cls.addClassCleanup(cls.client.close)
        cls.result = cls.measured_and_diagnosed()
        # Of a hundred right models one is refused, by the rate that is promised: then once more.
        if cls.result.get("diagnosis", {}).get("verdict") == "unexplained":
            cls.result = cls.measured_and_diagnosed()

    @classmethod
    def measured_and_diagnosed(cls):
        client, start = cls.client, len(cls.client.lines)
        client.start(campaign())
        client.until(lambda line: line.get("type") == "run_stop" and line["run"] == "fast", 90, start=start)
        client.until_state("IDLE", start=len(client.lines) - 1)
        client.renewing = False
        client.ask("control.release")
        client.ask("diagnose")
        return client.until(lambda line: line.get("type") == "diagnosis_result", 120, start=start)

    @classmethod
    def end_virtual(cls):
        cls.virtual.terminate()
        cls.virtual.communicate()

    def test_both_are_used_and_the_friction_is_named(self):
        self.assertEqual(self.result["status"], "done", self.result)
        found = self.result["diagnosis"]
        notes = " ".join(found["warnings"])
        self.assertIn("channel force is used beside the displacement, as load between", notes)
        self.assertIn("channel acceleration is used beside the displacement, as absolute", notes)
        self.assertEqual(found["verdict"], "explained", notes)
        self.assertEqual([effect["name"] for effect in found["effects"]], ["coulomb_friction"])
        [friction] = found["effects"][0]["parameters"]
        self.assertLess(abs(friction["value"] - FRICTION), 4 * friction["standard_error"])


if __name__ == "__main__":
    unittest.main()
