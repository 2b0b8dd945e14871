"""The installed service is interrupted by SIGKILL and by a hang while it measures; each time the exciter
ends at zero, systemd starts the service again, and the data are whole."""
import json
import signal

from guest import Listener, expect, journal, run, step, unit_property, wait_for
from rig_pc import SOCKET, as_technician, at_rest, start_campaign, start_the_rig, the_data_are_whole


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
    exciter, _ = start_the_rig()
    fails_in_mid_run(exciter, signal.SIGKILL, "signal")
    fails_in_mid_run(exciter, signal.SIGSTOP, "watchdog")
    step("done")


main()
