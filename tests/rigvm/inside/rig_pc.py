"""The rig PC as the scenarios of the service find it: the Debian package installed, the virtual rig's
exciter on Modbus TCP and its sensors on a real vcan0, campaigns, and what must be in the database."""
import glob
import json
import pathlib
import re
import sqlite3
import struct
import subprocess

from guest import Bus, Registers, expect, run, step, wait_for

SOCKET = "/run/shakerd/shakerd.sock"
DATA = "/var/lib/shakerd"
EXAMPLES = "/usr/share/shakerd/examples/"
PORT = 1502
RATE_HZ, FREQUENCY_HZ, AMPLITUDE, POINTS = 250, 2.5, 2.0, 8  # POINTS: of a cycle
ENABLE = 4                      # a register of the exciter: sim/README.md
TABLE = 386                     # a frame: sim/oleosim.dbc
HEARTBEAT_TIMEOUT_S = 2.0       # the exciter's own; ExecStopPost is there before it


def install():
    """By dpkg; its scripts make user, group, folders and socket. And two users: one may, one may not."""
    # The index of all manual pages would need more open files than the virtual kernel has.
    pathlib.Path("/var/lib/man-db/auto-update").unlink(missing_ok=True)
    run("dpkg", "--install", "/srv/rigvm/shakerd.deb")
    run("useradd", "--create-home", "--groups", "shaker", "technician")
    run("useradd", "--create-home", "stranger")


def patient_rig(example):
    """An example's rig file for this machine, with one slow CPU that it shares with whatever else the host does."""
    text = open(EXAMPLES + example).read()
    rig = json.loads(re.sub(r"^\s*//.*$", "", text, flags=re.MULTILINE))
    rig["limits"] |= {"stale_s": 1.0, "engine_stall_s": 2.0, "acquisition_stall_s": 5.0}
    rig["exciter"]["deadman_max_s"] = HEARTBEAT_TIMEOUT_S
    rig["exciter"]["device"]["link"]["response_timeout_s"] = 0.5
    return rig


def write_files():
    json.dump(patient_rig("rig-oleosim-can.json"), open("/etc/shakerd/rig.json", "w"))
    run("sh", "-c", f"cp {EXAMPLES}*.dbc /etc/shakerd/")
    write_campaign("short", 12)
    write_campaign("long", 5000)


def write_campaign(name, cycles, amplitude=AMPLITUDE, frequency_hz=FREQUENCY_HZ):
    campaign = {
        "format": "shaker-campaign/1", "name": name,
        "model": {"name": "oleo", "effects": [
            {"effect": "orifice_damping", "parameters": {"theta1": {"start": 14.0}}},
            {"effect": "gas_spring", "parameters": {
                "theta2": {"start": 1.8}, "theta3": {"start": 4.8},
                "theta4": {"start": 1.0, "fixed": True}}},
            {"effect": "gravity"}]},
        "points_per_cycle": POINTS,  # a gap of one such step, 50 ms, is allowed
        "ramp_s": 0.5,
        "runs": [{"name": "dwell", "frequency_hz": frequency_hz, "amplitude": amplitude, "cycles": cycles}]}
    json.dump(campaign, open(f"/home/technician/{name}.json", "w"))


def floats(registers):
    return struct.unpack(">f", struct.pack(">HH", *registers))[0]


def at_rest(exciter):
    """Disabled, and the table itself says that it stands."""
    running = exciter.read_input(0)[0] & 1
    return exciter.read(ENABLE)[0] == 0 and not running and floats(exciter.read_input(4, 2)) == 0.0


def as_technician(*command):
    return ["runuser", "-u", "technician", "--", *command]


def status_of_the_daemon():
    """The first connection starts the daemon, which takes seconds where the clock is late."""
    def answer():
        said = run(*as_technician("shakerctl", "status", "--json"), check=False)
        return json.loads(said.stdout) if said.returncode == 0 else None
    return wait_for("the daemon answers", 30, answer)


def start_campaign(name, socket=SOCKET):
    """What shakerctl says goes out with the results."""
    output = open(f"/srv/rigvm/out/shakerctl-{name}.jsonl", "a")
    return subprocess.Popen(as_technician("shakerctl", "run", "--json", "--socket", socket,
                                          f"/home/technician/{name}.json"),
                            stdout=output, stderr=subprocess.STDOUT)


def start_the_rig():
    """Installs, writes the rig's and the campaigns' files, starts the virtual rig: its exciter's registers, its bus."""
    step("dpkg installs the package")
    install()
    write_files()
    step("the virtual rig serves Modbus TCP and vcan0")
    run("systemd-run", "--unit=oleosim", "oleosim", "--port", str(PORT), "--can", "vcan0", "--rate", str(RATE_HZ),
        "--heartbeat-timeout", str(HEARTBEAT_TIMEOUT_S))
    bus = Bus("vcan0")
    wait_for("frames on vcan0", 20, lambda: len(bus.frames) > 10)
    exciter = Registers(PORT)
    expect(at_rest(exciter), "the exciter does not rest before anything was asked")
    return exciter, bus


def the_data_are_whole(listener, least_cycles, data=DATA):
    """What was published is in the database, and the cycles' estimates with it."""
    files = sorted(glob.glob(data + "/*.db"))
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
