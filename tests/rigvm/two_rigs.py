"""Two rigs on one PC: two instances of the installed template units, two campaigns at once. Each rig has its own
sockets, data, page and bridge; what happens to one does not reach the other; two instances never share an exciter."""
import glob
import json
import os
import urllib.request

from guest import Listener, Registers, expect, journal, run, step, unit_property, wait_for
from rig_pc import (ENABLE, EXAMPLES, HEARTBEAT_TIMEOUT_S, at_rest, floats, install, patient_rig, start_campaign,
                    the_data_are_whole, write_campaign)

RATE_HZ, FREQUENCY_HZ = 100, 1.5  # two rigs share one slow CPU
RIGS = {"left": (1502, "vcan0"), "right": (1503, "vcan1")}  # exciter's port and sensors' bus of each
AMPLITUDES = {"left": 2.0, "right": 1.5}
PAGES = {"left": 8421, "right": 8422}


def socket_of(rig):
    return f"/run/shakerd/{rig}/shakerd.sock"


def write_rig(name, port, bus):
    """As an operator: /etc/shakerd/RIG.json."""
    rig = patient_rig("rig-oleosim-can.json")
    rig["exciter"]["device"]["link"]["transport"]["port"] = port
    rig["sensors"][0]["interface"] = bus
    json.dump(rig | {"name": name}, open(f"/etc/shakerd/{name}.json", "w"))


def start_the_rigs():
    """Gives the independent Modbus clients of both."""
    step("dpkg installs the package; two virtual rigs, two rig files, two instances")
    install()
    run("sh", "-c", f"cp {EXAMPLES}*.dbc /etc/shakerd/; ip link add dev vcan1 type vcan && ip link set vcan1 up")
    for name, (port, bus) in RIGS.items():
        run("systemd-run", f"--unit=oleosim-{name}", "oleosim", "--port", str(port), "--can", bus, "--rate",
            str(RATE_HZ), "--heartbeat-timeout", str(HEARTBEAT_TIMEOUT_S))
        write_rig(name, port, bus)
        write_campaign(name, 5000, AMPLITUDES[name], FREQUENCY_HZ)
    run("systemctl", "enable", "--now", *(f"shakerd@{name}.service" for name in RIGS))
    return {name: Registers(port) for name, (port, _) in RIGS.items()}


def what_each_has():
    step("each has sockets, data and a lock of its own; the service of one rig is not needed")
    expect(unit_property("shakerd.service", "ActiveState") == "inactive", "the service of one rig was started")
    for name in RIGS:
        expect(unit_property(f"shakerd@{name}.service", "ActiveState") == "active", f"{name} does not run")
        for path in (socket_of(name), f"/run/shakerd-view/{name}/view.sock", f"/run/shakerd/{name}/rig.json"):
            expect(os.path.exists(path), f"there is no {path}")
    locks = glob.glob("/run/shakerd/exciter-*.lock")
    expect(len(locks) == 2, f"these locks, not one for each exciter: {locks}")
    refused = run("runuser", "-u", "stranger", "--", "shakerctl", "status", "--socket", socket_of("left"), check=False)
    expect(refused.returncode == 3, f"a stranger was not turned away: {refused.stdout}")


def one_exciter_has_one_daemon(exciters):
    step("a third instance whose rig file names the exciter of the first is refused, and moves nothing")
    write_rig("again", *RIGS["left"])
    run("systemctl", "start", "shakerd@again.service", check=False)
    wait_for("it has ended", 20, lambda: unit_property("shakerd@again.service", "ActiveState") == "failed")
    expect(unit_property("shakerd@again.service", "ExecMainStatus") == "3", "it did not end with status 3")
    expect("there can be only one" in journal("shakerd@again.service"), "it does not say why")
    expect(not at_rest(exciters["left"]), "it has stopped the exciter of the first")
    run("systemctl", "stop", "shakerd@again.socket", "shakerd-view@again.socket")


def both_measure(exciters):
    step("two campaigns at once")
    listeners = {name: Listener(socket_of(name)) for name in RIGS}
    for name in RIGS:
        start_campaign(name, socket_of(name))
    wait_for("both measure", 60, lambda: all(one.state() == "MEASURE" for one in listeners.values()))
    for name, exciter in exciters.items():
        asked = floats(exciter.read(2, 2))
        expect(abs(asked / AMPLITUDES[name] - 1) < 0.3 and exciter.read(ENABLE)[0] == 1,
               f"an independent Modbus client reads {asked} m/s^2 from {name}")
    return listeners


def pages():
    step("each has a page of its own, of its own campaigns; the second one has another port by a drop-in")
    folder = "/etc/systemd/system/shakerd-gateway@right.socket.d"
    os.makedirs(folder)
    with open(folder + "/port.conf", "w") as file:
        file.write(f"[Socket]\nListenStream=\nListenStream=127.0.0.1:{PAGES['right']}\n")
    run("systemctl", "daemon-reload")
    for name, port in PAGES.items():
        run("systemctl", "start", f"shakerd-gateway@{name}.socket")
        with urllib.request.urlopen(f"http://127.0.0.1:{port}/campaigns.json", timeout=60) as answer:
            [campaign] = json.loads(answer.read())["campaigns"]
        expect(os.path.exists(f"/var/lib/shakerd/{name}/{campaign['name']}.db"), f"{campaign} is not of {name}")


def one_is_killed(exciters, listeners):
    def accepted(name):
        return sum(d["accepted"] for d in listeners[name].of_type("cycle"))

    step("one daemon is killed: its table rests, and the other rig goes on measuring")
    wait_for("accepted cycles of both", 60, lambda: min(accepted("left"), accepted("right")) >= 2)
    before = accepted("right")
    run("kill", "-KILL", unit_property("shakerd@left.service", "MainPID"))
    wait_for("the left exciter at zero", 6, lambda: at_rest(exciters["left"]))
    wait_for("systemd has started the left one again", 30, lambda: (
        unit_property("shakerd@left.service", "NRestarts") == "1"
        and unit_property("shakerd@left.service", "ActiveState") == "active"))
    wait_for("the right one goes on measuring", 60, lambda: accepted("right") >= before + 3)
    expect(at_rest(exciters["left"]), "the left exciter moves again")
    expect(not at_rest(exciters["right"]), "the right exciter rests")
    step("each can be stopped by itself; nothing acknowledged is lost")
    run("systemctl", "stop", "shakerd@right.service")
    expect(at_rest(exciters["right"]), "the right exciter does not rest after the stop")
    expect(unit_property("shakerd@right.service", "Result") == "success", "the right one did not stop as asked")
    expect(unit_property("shakerd@left.service", "ActiveState") == "active", "the left one was stopped too")
    for name in RIGS:
        the_data_are_whole(listeners[name], 2, f"/var/lib/shakerd/{name}")


def main():
    exciters = start_the_rigs()
    what_each_has()
    listeners = both_measure(exciters)
    one_exciter_has_one_daemon(exciters)
    pages()
    one_is_killed(exciters, listeners)
    step("the package goes with all its instances; the campaigns stay")
    run("dpkg", "--purge", "shakerd")
    for name in RIGS:
        expect(unit_property(f"shakerd@{name}.service", "ActiveState") == "inactive", f"{name} outlives its package")
        expect(len(glob.glob(f"/var/lib/shakerd/{name}/*.db")) == 1, f"purging took the campaign of {name} along")
    expect(not glob.glob("/etc/systemd/system/*/shakerd*@*"), "an instance is still enabled")
    step("done")


main()
