"""The installed bridge under a real systemd, with a real broker: its user, what it sees, and that it does not start a
daemon that somebody has stopped."""
import os
import subprocess
import time

from guest import expect, run, step, unit_property, wait_for
from rig_pc import SOCKET, install

BROKER_PORT = 1883
WORDS = "/srv/rigvm/out/bridge.txt"
CONFIGURATION = f"listener {BROKER_PORT} 127.0.0.1\nallow_anonymous true\nuser root\n"


def retained():
    """What a late subscriber gets: the kinds."""
    said = run("mosquitto_sub", "-h", "127.0.0.1", "-p", str(BROKER_PORT), "-t", "shaker/simulated/+", "-F", "%t",
               "--retained-only", "-W", "1", check=False).stdout
    return {topic.rsplit("/", 1)[1] for topic in said.split()}


def words():
    """What the bridge has said of itself so far."""
    return open(WORDS).read().split()


def until_bridge_says(word):
    wait_for(f"the bridge says {word}", 30, lambda: words()[-1:] == [word])


def start_the_broker():
    open("/run/broker.conf", "w").write(CONFIGURATION)
    subprocess.Popen(["/usr/sbin/mosquitto", "-c", "/run/broker.conf"], stdout=open("/srv/rigvm/out/broker.log", "w"),
                     stderr=subprocess.STDOUT)
    wait_for("the broker answers", 20, lambda: run(
        "mosquitto_pub", "-h", "127.0.0.1", "-t", "x", "-n", check=False).returncode == 0)
    subprocess.Popen(["mosquitto_sub", "-h", "127.0.0.1", "-p", str(BROKER_PORT), "-t", "shaker/simulated/bridge"],
                     stdout=open(WORDS, "w"))
    open("/etc/default/shakerd-mqtt", "w").write(f'OPTIONS="--broker 127.0.0.1 --port {BROKER_PORT}"\n')


def what_the_bridge_may():
    step("the bridge has a user of its own, sees neither the socket that commands nor campaigns")
    main_pid = unit_property("shakerd-mqtt.service", "MainPID")
    status = open(f"/proc/{main_pid}/status").read()
    uid = run("id", "-u", "shakerd-mqtt").stdout.strip()
    expect(f"Uid:\t{uid}\t{uid}\t" in status and uid != "0", "it does not run as its own user")
    expect("CapEff:\t0000000000000000" in status, "it has capabilities")
    its_root = f"/proc/{main_pid}/root"
    expect(os.path.exists(its_root + "/run/shakerd-view/view.sock"), "it does not see the socket of those who look on")
    expect(os.path.exists(SOCKET) and not os.path.exists(its_root + SOCKET), "it sees the socket that commands")
    expect(os.listdir(its_root + "/var/lib/shakerd") == [], "it sees campaigns")
    refused = run("runuser", "-u", "shakerd-mqtt", "--", "shakerctl", "stop", check=False)
    expect(refused.returncode == 3, f"it may stop the rig: {refused.stdout}")


def main():
    step("dpkg installs the package")
    install()
    expect(unit_property("shakerd-mqtt.service", "ActiveState") == "inactive", "the bridge runs unasked")
    start_the_broker()
    step("enabled and started, it publishes")
    run("systemctl", "enable", "--now", "shakerd-mqtt.service")
    until_bridge_says("online")
    wait_for("state and health are retained", 30, lambda: retained() >= {"bridge", "state", "health"})
    what_the_bridge_may()
    step("a daemon that was killed is told, and comes back by itself")
    run("kill", "-KILL", unit_property("shakerd.service", "MainPID"))
    wait_for("the bridge has told of it", 20, lambda: "daemon_lost" in words())
    until_bridge_says("online")
    step("a daemon that was stopped stays so, and the bridge says it")
    run("systemctl", "stop", "shakerd.service")
    until_bridge_says("daemon_lost")
    time.sleep(2)
    expect(unit_property("shakerd.service", "ActiveState") == "inactive", "the bridge has started the daemon again")
    expect(unit_property("shakerd-mqtt.service", "NRestarts") == "0", "the bridge had to be started again")
    step("it sees the daemon that comes back")
    run("systemctl", "start", "shakerd.service")
    until_bridge_says("online")
    run("dpkg", "--purge", "shakerd")
    expect(unit_property("shakerd-mqtt.service", "ActiveState") == "inactive", "the bridge outlives its package")
    step("done")


main()
