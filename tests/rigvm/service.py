"""The installed service on real wires: the Debian package, a real systemd, the virtual rig. A technician
runs a campaign, watched by independent clients; then the service is stopped and the package purged."""
import glob
import json
import math
import os
import shutil
import sqlite3
import struct
import subprocess
import threading
import time
import urllib.request

import h5py

from guest import Listener, expect, run, step, unit_property, wait_for
from rig_pc import (AMPLITUDE, ENABLE, FREQUENCY_HZ, POINTS, RATE_HZ, SOCKET, TABLE, as_technician, at_rest, floats,
                    start_campaign, start_the_rig, status_of_the_daemon, the_data_are_whole)

ADDRESS = "http://127.0.0.1:8420/"


def look_at_the_installation():
    step("dpkg has installed the package: units, socket, network file")
    run("systemd-analyze", "verify", "--man=no", "shakerd.service", "shakerd.socket", "shakerd-view.socket",
        "shakerd-gateway.service", "shakerd-gateway.socket")
    expect(unit_property("shakerd-gateway.socket", "ActiveState") == "inactive", "the page is served unasked")
    expect(unit_property("shakerd.socket", "ActiveState") == "active", "the socket is not active")
    expect(unit_property("shakerd.service", "ActiveState") == "inactive", "the daemon runs unasked")
    said = run("sh", "-c", "SYSTEMD_LOG_LEVEL=debug timeout 3 /lib/systemd/systemd-networkd; true")
    wrong = [line for line in said.stderr.splitlines() if "80-can0" in line]
    expect(not wrong, f"systemd-networkd complains of the network file: {wrong}")


def who_may_connect():
    step("a member of the group shaker may ask, a stranger may not; the first client starts the daemon")
    refused = run("runuser", "-u", "stranger", "--", "shakerctl", "status", check=False)
    expect(refused.returncode == 3, f"a stranger was not turned away: {refused.stdout}")
    answer = status_of_the_daemon()
    expect(answer["state"]["state"] == "IDLE", f"the rig is not idle: {answer['state']}")
    expect(unit_property("shakerd.service", "ActiveState") == "active", "the daemon is not active")


class Page:
    """A browser that is no browser: it follows the gateway's events."""

    def __init__(self):
        run("systemctl", "start", "shakerd-gateway.socket")
        self.events = []
        self.answer = urllib.request.urlopen(ADDRESS + "events", timeout=60)  # starts the gateway
        threading.Thread(target=self.read, daemon=True).start()

    def read(self):
        for line in self.answer:
            if line.startswith(b"data: {"):
                self.events.append(json.loads(line[6:]))

    def of_type(self, kind):
        return [event for event in list(self.events) if event.get("type") == kind]

    def live(self):
        """Whether the page says that the daemon answers."""
        return [event["connected"] for event in list(self.events) if "connected" in event][-1:] == [True]


def get(path):
    with urllib.request.urlopen(ADDRESS + path, timeout=30) as answer:
        return answer.read()


def what_the_gateway_may():
    step("the gateway has a user of its own, sees no socket that commands, and has no network")
    main_pid = unit_property("shakerd-gateway.service", "MainPID")
    status = open(f"/proc/{main_pid}/status").read()
    uid = run("id", "-u", "shakerd-gateway").stdout.strip()
    expect(f"Uid:\t{uid}\t{uid}\t" in status and uid != "0", "it does not run as its own user")
    expect("CapEff:\t0000000000000000" in status, "it has capabilities")
    its_root = f"/proc/{main_pid}/root"
    expect(os.path.exists(its_root + "/run/shakerd-view/view.sock"), "it does not see the socket of those who look on")
    expect(os.path.exists(SOCKET) and not os.path.exists(its_root + SOCKET), "it sees the socket that commands")
    links = [line.split(":")[0].strip() for line in open(f"/proc/{main_pid}/net/dev") if ":" in line]
    expect(links == ["lo"], f"it sees a network: {links}")
    for user, code in (("shakerd-gateway", 3), ("stranger", 3)):
        refused = run("runuser", "-u", user, "--", "shakerctl", "stop", check=False)
        expect(refused.returncode == code, f"{user} may stop the rig: {refused.stdout}")


def what_the_page_showed(page, listener):
    step("the page's events and files are the campaign's")
    wait_for("the page has the end", 20, lambda: page.of_type("run_stop"))
    for kind in ("cycle", "estimate", "run_stop"):
        expect([d["seq"] for d in page.of_type(kind)] == [d["seq"] for d in listener.of_type(kind)],
               f"the page and a client of the daemon saw other documents: {kind}")
    for kind in ("wave", "scope", "rig", "health"):
        expect(page.of_type(kind), f"the page saw no {kind}")
    expect(b"shaker_up 1\n" in get("metrics"), "the metrics do not say that the daemon answers")
    [campaign] = wait_for("the campaign is closed", 20, lambda: [
        one for one in json.loads(get("campaigns.json"))["campaigns"] if not one["recording"]])
    data = get(f"campaigns/{campaign['name']}.db")
    expect(data == open(f"/var/lib/shakerd/{campaign['name']}.db", "rb").read(), "another campaign was downloaded")
    step(f"  {len(page.of_type('wave'))} waves, {len(page.of_type('scope'))} pictures of the scope, "
         f"{len(data)} bytes downloaded")


def strokes_by_h5py(file):
    with h5py.File(file) as mat:
        run1 = mat["run1"]
        # HDF5 has MATLAB's columns as rows.
        return [float(u) for cycle, good in zip(run1["displacement"], run1["accepted"][0]) if good for u in cycle]


def strokes_by_octave(file):
    said = run("octave-cli", "--eval", 'x = load("%s"); run = x.run1; printf("%%.17g\\n", '
               'run.displacement(:, run.accepted == 1));' % file, seconds=120).stdout
    return [float(word) for word in said.split()]


def a_campaign_taken_home(accepted):
    step("the campaign goes to MAT, and other programs read what the database holds")
    [database] = glob.glob("/var/lib/shakerd/*.db")
    os.makedirs("/tmp/home", exist_ok=True)
    shutil.chown("/tmp/home", "technician")
    said = run(*as_technician("shakerctl", "export", database, "--format", "mat", "--directory", "/tmp/home", "--json"))
    file = os.path.join("/tmp/home", json.loads(said.stdout)["files"][0]["file"])
    rows = sqlite3.connect(database).execute("SELECT displacement FROM cycle WHERE accepted AND run = 0 ORDER BY idx")
    kept = [u for blob, in rows for u in struct.unpack(f"<{len(blob) // 8}d", blob)]
    expect(len(kept) == POINTS * accepted, f"{len(kept)} points of {accepted} cycles")
    expect(strokes_by_h5py(file) == kept, "h5py reads other strokes")
    octave = shutil.which("octave-cli") is not None
    if octave:
        expect(strokes_by_octave(file) == kept, "Octave reads other strokes")
    step(f"  {len(kept)} points of {accepted} cycles; read by h5py{' and Octave' if octave else '; no Octave here'}")


def a_stop_beside_an_open_page(page):
    step("asked to stop, the service stops and stays so, although a page is open")
    expect(page.live(), "the page does not follow the daemon")
    run("systemctl", "stop", "shakerd.service")
    expect(unit_property("shakerd.service", "Result") == "success", "it did not stop as asked")
    wait_for("the page says so", 20, lambda: not page.live())
    time.sleep(2)  # the gateway tries again every half second
    expect(unit_property("shakerd.service", "ActiveState") == "inactive", "the gateway has started the daemon again")
    expect(unit_property("shakerd-gateway.service", "ActiveState") == "active", "the gateway has ended")
    step("one who may command starts it, and the page is live again")
    status_of_the_daemon()
    wait_for("the page follows the daemon again", 20, page.live)


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
    # The trim moves the amplitude by what it measures: by some per cent where the clock is late.
    expect(math.isclose(frequency, FREQUENCY_HZ, rel_tol=1e-6) and
           math.isclose(amplitude, AMPLITUDE, rel_tol=0.05) and exciter.read(ENABLE)[0] == 1,
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


def main():
    exciter, bus = start_the_rig()
    look_at_the_installation()
    who_may_connect()
    page = Page()
    what_the_gateway_may()
    listener = a_whole_campaign(exciter, bus)
    what_the_page_showed(page, listener)
    accepted, estimates = the_data_are_whole(listener, 12)
    expect(estimates == accepted, f"{accepted} accepted cycles, {estimates} estimates")
    a_campaign_taken_home(accepted)
    a_stop_beside_an_open_page(page)
    step("its data outlive the package")
    run("systemctl", "stop", "shakerd.service")
    expect(at_rest(exciter), "the exciter does not rest after the stop")
    run("dpkg", "--purge", "shakerd")
    expect(len(glob.glob("/var/lib/shakerd/*.db")) == 1, "purging the package took the campaign along")
    step("done")


main()
