"""tests/system in the sandbox of the installed unit: the tests are a service with every line of shakerd.service that
confines it, and the daemons that they start inherit all of it: system calls, address families, capabilities, mounts.
What the unit says of starting, watching and restarting is left out: service.py and service_dies.py try that.
The file `suite` beside this one holds the source's folder, and `short` or `whole`."""
import pathlib
import re
import subprocess

from guest import expect, run, step, unit_property
from rig_pc import install

SOURCE, PART = pathlib.Path("/srv/rigvm/suite").read_text().split()
SOURCE = pathlib.Path(SOURCE)
COPY = pathlib.Path("/usr/local/share/suite")
NEEDED = ("tests/system", "protocol/schema", "config/examples", "docs/protocol.md",
          "docs/protocol_onlookers.md", "systemd/shakerd.service.in")
# How it is run is the tests' affair; what it may do is the unit's.
RUNS = re.compile(r"(Type|Exec\w+|Restart\w*|WatchdogSec|Timeout\w+|RuntimeDirectory\w*|UMask)=")
# A browser compiles JavaScript in memory, which MemoryDenyWriteExecute= forbids. It is no part of the daemon, nor are
# gateway, bridge and the server of a database.
LEFT_OUT = ("browser_test", "gateway_test", "mqtt_test", "page_test", "prometheus_test", "push_test", "rigs_test")
# Files, sockets, child processes, locks and recovery: what a sandbox may forbid.
SHORT = ("campaign_test", "crash_test", "diagnose_test", "lock_test", "requests_test", "start_test")
SECONDS = 800


def copy_the_tests():
    for part in NEEDED:
        target = COPY / part
        run("mkdir", "-p", str(target.parent))
        run("cp", "-r", str(SOURCE / part), str(target))
    run("chmod", "-R", "a+rX", str(COPY))


def confined_unit(words):
    """The service of the tests, as the installed unit confines its own."""
    unit = pathlib.Path(run("systemctl", "show", "--value", "-p", "FragmentPath", "shakerd.service").stdout.strip())
    body = unit.read_text().split("[Service]\n")[1].split("\n[")[0]
    lines = [line for line in body.splitlines() if re.match(r"\w+=", line) and not RUNS.match(line)]
    expect(len([line for line in lines if line.startswith("SystemCallFilter")]) == 2 and len(lines) > 25,
           f"the unit has lost its sandbox: {lines}")
    more = ["Type=oneshot", f"WorkingDirectory={COPY}/tests/system", f"TimeoutStartSec={SECONDS}",
            f"ExecStart=/usr/bin/python3 -m unittest -v {words}",
            "StandardOutput=append:/srv/rigvm/out/suite.log", "StandardError=append:/srv/rigvm/out/suite.log",
            f"Environment=SHAKER_SOURCE={COPY} PYTHONDONTWRITEBYTECODE=1 PYTHONUNBUFFERED=1 HOME=/tmp "
            "SHAKERD=/usr/bin/shakerd SHAKERCTL=/usr/bin/shakerctl OLEOSIM=/usr/bin/oleosim"]
    pathlib.Path("/run/systemd/system/suite.service").write_text("\n".join(
        ["[Unit]", "Description=The system tests in the sandbox of shakerd.service", "[Service]", *lines, *more, ""]))
    run("systemctl", "daemon-reload")
    return lines


def main():
    step("dpkg installs the package")
    install()
    copy_the_tests()
    names = sorted(path.stem for path in (COPY / "tests/system").glob("*_test.py") if path.stem not in LEFT_OUT)
    words = " ".join(name for name in names if PART == "whole" or name in SHORT)
    step(f"{words}, confined by {len(confined_unit(words))} lines of the installed unit")
    subprocess.run(["systemctl", "start", "suite.service"], timeout=SECONDS + 60, check=False)
    said = pathlib.Path("/srv/rigvm/out/suite.log").read_text()
    for story in re.findall(r"^={70}\n(?:ERROR|FAIL): .*?(?=^={70}|\Z)", said, re.MULTILINE | re.DOTALL):
        print(story if len(story) < 4000 else f"{story[:1000]}\n...\n{story[-3000:]}")
    print(said[-500:])
    result = unit_property("suite.service", "Result")
    expect(re.search(r"^Ran \d+ tests", said, re.MULTILINE), f"the tests did not come to an end: {result}")
    expect(result == "success", f"the service ended with {result}")
    step("done")


main()
