"""The installed service on real wires: the Debian package, a real systemd, the virtual rig's exciter on
Modbus TCP and its sensors on a real vcan0. A campaign is run, watched by independent clients, and
interrupted by SIGKILL and by a hang; each time the exciter ends at zero and the data are whole."""
import glob
import json
import math
import re
import signal
import sqlite3
import struct
import subprocess

from guest import Bus, Listener, Registers, expect, journal, run, step, unit_property, wait_for

SOCKET = "/run/shakerd/shakerd.sock"
PORT = 1502
RATE_HZ, FREQUENCY_HZ, AMPLITUDE = 250, 2.5, 2.0
ENABLE = 4                      # a register of the exciter: sim/README.md
TABLE = 386                     # a frame: sim/oleosim.dbc
HEARTBEAT_TIMEOUT_S = 2.0       # the exciter's own; ExecStopPost is there before it


def install():
    step("dpkg installs the package; its scripts make user, group, folders and socket")
    run("dpkg", "--install", "/srv/rigvm/shakerd.deb")
    run("systemd-analyze", "verify", "--man=no", "shakerd.service", "shakerd.socket")
    expect(unit_property("shakerd.socket", "ActiveState") == "active", "the socket is not active")
    expect(unit_property("shakerd.service", "ActiveState") == "inactive", "the daemon runs unasked")
    said = run("sh", "-c", "SYSTEMD_LOG_LEVEL=debug timeout 3 /lib/systemd/systemd-networkd; true")
    wrong = [line for line in said.stderr.splitlines() if "80-can0" in line]
    expect(not wrong, f"systemd-networkd complains of the network file: {wrong}")
    run("useradd", "--create-home", "--groups", "shaker", "technician")
    run("useradd", "--create-home", "stranger")


def write_files():
    examples = "/usr/share/shakerd/examples/"
    text = open(examples + "rig-oleosim-can.json").read()
    rig = json.loads(re.sub(r"^\s*//.*$", "", text, flags=re.MULTILINE))
    # This machine has one slow CPU that it shares with whatever else the host does.
    rig["limits"]["stale_s"] = 1.0
    rig["exciter"]["device"]["link"]["response_timeout_s"] = 0.5
    json.dump(rig, open("/etc/shakerd/rig.json", "w"))
    run("sh", "-c", f"cp {examples}*.dbc /etc/shakerd/")
    campaign = {
        "format": "shaker-campaign/1",
        "model": {"name": "oleo", "effects": [
            {"effect": "orifice_damping", "parameters": {"theta1": {"start": 14.0}}},
            {"effect": "gas_spring", "parameters": {
                "theta2": {"start": 1.8}, "theta3": {"start": 4.8},
                "theta4": {"start": 1.0, "fixed": True}}},
            {"effect": "gravity"}]},
        "points_per_cycle": 8,  # a gap of one such step, 50 ms, is allowed
        "ramp_s": 0.5}
    for name, cycles in (("short", 12), ("long", 5000)):
        runs = [{"name": "dwell", "frequency_hz": FREQUENCY_HZ, "amplitude": AMPLITUDE,
                 "cycles": cycles}]
        open(f"/home/technician/{name}.json", "w").write(
            json.dumps(campaign | {"name": name, "runs": runs}))


def floats(registers):
    return struct.unpack(">f", struct.pack(">HH", *registers))[0]


def at_rest(exciter):
    """Disabled, and the table itself says that it stands."""
    running = exciter.read_input(0)[0] & 1
    return exciter.read(ENABLE)[0] == 0 and not running and floats(exciter.read_input(4, 2)) == 0.0


def as_technician(*command):
    return ["runuser", "-u", "technician", "--", *command]


def start_campaign(name):
    """What shakerctl says goes out with the results."""
    output = open(f"/srv/rigvm/out/shakerctl-{name}.jsonl", "a")
    return subprocess.Popen(as_technician("shakerctl", "run", "--json", f"/home/technician/{name}.json"),
                            stdout=output, stderr=subprocess.STDOUT)


def who_may_connect():
    step("a member of the group shaker may ask, a stranger may not; the first client starts the daemon")
    refused = run("runuser", "-u", "stranger", "--", "shakerctl", "status", check=False)
    expect(refused.returncode == 3, f"a stranger was not turned away: {refused.stdout}")
    answer = json.loads(run(*as_technician("shakerctl", "status", "--json")).stdout)
    expect(answer["state"]["state"] == "IDLE", f"the rig is not idle: {answer['state']}")
    expect(unit_property("shakerd.service", "ActiveState") == "active", "the daemon is not active")


def frequency_of(frames):
    """From the frames alone: the table's acceleration crosses zero upwards once a period."""
    values = [(t, struct.unpack(">i", data[:4])[0] * 1e-5) for t, identifier, data in frames
              if identifier == TABLE]
    crossings = []
    for (t0, x0), (t1, x1) in zip(values, values[1:]):
        if x0 < 0 <= x1 and (not crossings or t1 - crossings[-1] > 0.5 / FREQUENCY_HZ):
            crossings.append(t0 + (t1 - t0) * -x0 / (x1 - x0))
    return (len(crossings) - 1) / (crossings[-1] - crossings[0])


def a_whole_campaign(exciter, bus):
    step("a campaign from start to end, run by a technician without any privilege")
    listener = Listener(SOCKET)
    dump = subprocess.Popen(["candump", "-n", "500", "-T", "20000", "vcan0"],
                            stdout=subprocess.PIPE, text=True)
    campaign = start_campaign("short")
    wait_for("the campaign measures", 60, lambda: (
        listener.state() == "MEASURE" or campaign.poll() is not None))
    frequency, amplitude = floats(exciter.read(0, 2)), floats(exciter.read(2, 2))
    expect(math.isclose(frequency, FREQUENCY_HZ, rel_tol=1e-6) and
           math.isclose(amplitude, AMPLITUDE, rel_tol=1e-6) and exciter.read(ENABLE)[0] == 1,
           f"an independent Modbus client reads {frequency} Hz, {amplitude} m/s^2")
    beat = exciter.read(7)[0]
    wait_for("the heartbeat counts", 5, lambda: exciter.read(7)[0] != beat)
    first = len(bus.frames)
    wait_for("two periods of both sensors' frames", 20, lambda: len(bus.frames) - first > 4 * RATE_HZ / FREQUENCY_HZ)
    measured = frequency_of(bus.frames[first:])
    expect(abs(measured / FREQUENCY_HZ - 1) < 0.05, f"the frames on vcan0 swing with {measured} Hz")
    seen = dump.communicate()[0]
    expect(" 181 " in seen and " 182 " in seen, "candump misses a sensor's frames")
    step(f"  Modbus: {frequency:g} Hz, {amplitude:g} m/s^2; CAN: {measured:.3f} Hz; candump agrees")
    status = campaign.wait(120)
    expect(status == 0, f"shakerctl ended with status {status}, see shakerctl-short.jsonl")
    wait_for("the exciter rests after the campaign", 10, lambda: at_rest(exciter))
    wait_for("the listener has the end", 5, lambda: listener.of_type("run_stop"))
    return listener


def the_data_are_whole(listener, least_cycles):
    """What was published is in the database, and the cycles' estimates with it."""
    files = sorted(glob.glob("/var/lib/shakerd/*.db"))
    name = (listener.of_type("run_start")[-1]["campaign"])
    database = sqlite3.connect([f for f in files if f.split("/")[-1].startswith(name)][-1])
    expect(database.execute("PRAGMA integrity_check").fetchone() == ("ok",), "the database is damaged")
    kept = {seq: json.loads(line) for seq, line in database.execute("SELECT seq, line FROM document")}
    begin = next(d["seq"] for d in listener.documents
                 if d.get("type") == "run_start" and d["campaign"] == name)
    lost = [d for d in listener.documents
            if d.get("seq", -1) >= begin and d.get("type") in ("run_start", "cycle", "estimate")
            and d["campaign"] == name and kept.get(d["seq"]) != d]
    expect(not lost, f"published, but not in the database: {lost[:2]}")
    accepted = [d for d in kept.values() if d["type"] == "cycle" and d["accepted"]]
    cycles = database.execute("SELECT count(*) FROM cycle WHERE accepted").fetchone()[0]
    estimates = sum(d["type"] == "estimate" for d in kept.values())
    samples = database.execute("SELECT sum(count) FROM sample").fetchone()[0]
    step(f"  {name}: {cycles} accepted cycles, {estimates} estimates, {samples} samples; integrity ok")
    expect(cycles >= max(least_cycles, len(accepted)), f"{cycles} cycles for {len(accepted)} documents")
    expect(samples and samples > cycles * RATE_HZ / FREQUENCY_HZ, f"only {samples} samples were kept")
    return len(accepted), estimates


def fails_in_mid_run(exciter, how, result):
    step(f"the daemon gets {how.name} while it measures")
    listener = Listener(SOCKET)
    campaign = start_campaign("long")
    wait_for("accepted cycles", 90, lambda: sum(
        d["accepted"] for d in listener.of_type("cycle")) >= 3)
    expect(not at_rest(exciter), "the table stands although the daemon measures")
    restarts = int(unit_property("shakerd.service", "NRestarts"))
    run("kill", f"-{how.name}", unit_property("shakerd.service", "MainPID"))
    wait_for("the exciter at zero", 6, lambda: at_rest(exciter))
    step("  the exciter is at zero")
    wait_for("systemd has started it again", 30, lambda: (
        int(unit_property("shakerd.service", "NRestarts")) == restarts + 1
        and unit_property("shakerd.service", "ActiveState") == "active"))
    expect(f"Failed with result '{result}'" in journal("shakerd.service"),
           f"systemd did not call it '{result}'")
    expect(campaign.wait(30) != 0, "shakerctl took the daemon's death for a success")
    answer = json.loads(run(*as_technician("shakerctl", "status", "--json"), check=False).stdout)
    expect(answer["state"]["state"] in ("IDLE", "FAULT"), f"after the restart: {answer['state']}")
    expect(at_rest(exciter), "the restarted daemon has moved the exciter")
    the_data_are_whole(listener, 3)


def main():
    install()
    write_files()
    step("the virtual rig serves Modbus TCP and vcan0")
    run("systemd-run", "--unit=oleosim", "oleosim", "--port", str(PORT), "--can", "vcan0", "--rate", str(RATE_HZ),
        "--heartbeat-timeout", str(HEARTBEAT_TIMEOUT_S))
    bus = Bus("vcan0")
    wait_for("frames on vcan0", 20, lambda: len(bus.frames) > 10)
    exciter = Registers(PORT)
    expect(at_rest(exciter), "the exciter does not rest before anything was asked")
    who_may_connect()
    listener = a_whole_campaign(exciter, bus)
    accepted, estimates = the_data_are_whole(listener, 12)
    expect(estimates == accepted, f"{accepted} accepted cycles, {estimates} estimates")
    fails_in_mid_run(exciter, signal.SIGKILL, "signal")
    fails_in_mid_run(exciter, signal.SIGSTOP, "watchdog")
    step("asked to stop, the service stops; its data outlive the package")
    run("systemctl", "stop", "shakerd.service")
    expect(unit_property("shakerd.service", "Result") == "success", "it did not stop as asked")
    expect(at_rest(exciter), "the exciter does not rest after the stop")
    run("dpkg", "--purge", "shakerd")
    expect(len(glob.glob("/var/lib/shakerd/*.db")) == 3, "purging the package took campaigns along")
    step("done")


main()
