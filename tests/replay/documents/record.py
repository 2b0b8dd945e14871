"""Records oleo.registers.log: a campaign on oleosim over Modbus TCP, by the daemon itself.

    /usr/bin/python3 record.py BIN_FOLDER     then can_of.py, and the golden files as README.md says
"""
import json
import pathlib
import re
import socket
import subprocess
import sys
import tempfile
import time

HERE = pathlib.Path(__file__).resolve().parent
SOURCE = HERE.parents[2]


def main(folder):
    binaries = pathlib.Path(folder).resolve()
    with tempfile.TemporaryDirectory() as scratch:
        scratch = pathlib.Path(scratch)
        oleosim = subprocess.Popen([binaries / "oleosim", "--port", "0", "--rate", "125", "--seed", "5"],
                                   stdout=subprocess.PIPE, text=True)
        port = int(re.search(r"port=(\d+)", oleosim.stdout.readline()).group(1))
        text = (SOURCE / "config/examples/rig-oleosim-modbus.json").read_text().replace("1502", str(port))
        text = text.replace('"rate_hz": 250', '"rate_hz": 125, "record_to": "log"').replace('"ramp_s": 1.0', '"ramp_s": 0.5')
        text = text.replace('"model": "model-oleo.json",', "")
        (scratch / "rig.json").write_text(text)
        daemon = subprocess.Popen([binaries / "shakerd", "--rig", scratch / "rig.json", "--socket", scratch / "s",
                                   "--data", scratch])
        try:
            began = campaign(scratch)
        finally:
            daemon.terminate()
            daemon.wait()
            oleosim.terminate()
        cut((scratch / "log").read_text().splitlines(), began)


def campaign(scratch):
    """Runs it; the time at which the self check began, s of CLOCK_MONOTONIC."""
    stream = socket.socket(socket.AF_UNIX)
    for _ in range(100):
        if not stream.connect_ex(str(scratch / "s")):
            break
        time.sleep(0.1)
    time.sleep(1.0)
    lines = stream.makefile("r")
    spec = json.loads((HERE / "campaign.json").read_text())
    for number, (method, params) in enumerate([("control.acquire", {}), ("campaign.start", {"campaign": spec})]):
        stream.sendall((json.dumps({"jsonrpc": "2.0", "id": number, "method": method, "params": params}) + "\n").encode())
    began = None
    for text in lines:
        document = json.loads(text)
        stream.sendall(b'{"jsonrpc": "2.0", "method": "lease.renew"}\n')
        if document.get("state") == "CHECK" and began is None:
            began = document["t_mono_ns"] * 1e-9
        if document.get("type") == "run_stop":
            print(document["status"], document["reason"])
            return began
    sys.exit("the daemon has gone")


def cut(lines, began):
    """From a tenth of a second before the campaign on, which is when a replay starts one."""
    kept = [line for line in lines if float(line[1:line.index(" ")]) >= began - 0.1]
    (HERE / "oleo.registers.log").write_text("".join(line + "\n" for line in kept))
    print(len(kept), "polls")


if __name__ == "__main__":
    main(sys.argv[1])
