"""How each fault is done to a stand: a function that begins it, and gives the function that lifts it."""
import contextlib
import math
import os
import pathlib
import random
import shutil
import signal
import socket
import sqlite3
import subprocess
import threading

import crowd
import freeze
import lies_drive
import modbus_wire as modbus
import shim
from daemon import Client
from stand import AMPLITUDE, FREQUENCY_HZ, campaign


class Unavailable(Exception):
    """This machine or this daemon does not let the fault be tried; the sentence says why."""


def nothing():
    pass


# --- wires and what is behind them

def on(link, rule):
    """A rule on the proxy named "exciter" or "sensor"."""
    return lambda stand: getattr(stand, link).add(rule(stand))


def reset(link):
    def begin(stand):
        getattr(stand, link).reset_all()
        return nothing
    return begin


def rig_fault(number):
    return lambda stand: lies_drive.inject(stand.rig_port, number)


def rig_stands_still(stand):
    """The controller's program is stopped for a second: its own dead-man cannot run meanwhile."""
    stand.rig.send_signal(signal.SIGSTOP)
    thaw = threading.Timer(1.0, lambda: stand.rig.send_signal(signal.SIGCONT))
    thaw.start()
    return thaw.join


def rig_dies(stand):
    stand.observer.end()  # there is nothing to see, and nothing to wait for
    stand.rig.kill()
    stand.rig.wait()
    return held(stand.rig_port).close


def held(port):
    """A socket that keeps a port from others without listening: the daemon that lost its rig goes on to stop what
    answers there, which may not be the rig of another round."""
    holder = socket.socket()
    holder.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)  # its connections are being closed
    holder.bind(("127.0.0.1", port))
    holder.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 0)  # nor may another bind beside it
    return holder


def stop_with(rule, dead_man_works=True):
    """Anyone asks for a stop, and the drive does what `rule` says."""
    def begin(stand):
        remove = stand.exciter.add(rule())
        beats = None if dead_man_works else lies_drive.DeadManThatDoesNotWork(stand.rig_port)
        ask(stand, "stop")

        def lift():
            if beats:
                beats.end()
            lies_drive.stop_past_the_daemon(stand.rig_port)
            remove()
        return lift
    return begin


def moves_otherwise(rule, register, value):
    """From now on the drive does something else than it was told; what it was told reads back."""
    def begin(stand):
        made = rule()
        made.told = made.back(value)
        remove = stand.exciter.add(made)
        reading = stand.observer.last()
        if reading and reading.moves:
            lies_drive.write_past_the_daemon(stand.rig_port, register, value)
        return remove
    return begin


doubles = dict(register=modbus.AMPLITUDE, value=2 * AMPLITUDE)


def hurries(times):
    return dict(register=modbus.FREQUENCY, value=times * FREQUENCY_HZ)


# --- the process

def ask(stand, method):
    """One request on a connection of its own, whether or not it is answered."""
    with contextlib.suppress(OSError), contextlib.closing(Client(stand.daemon.socket, patience=0.2)) as client:
        client.send({"jsonrpc": "2.0", "id": 1, "method": method})
        client.read(0.2)


def killed(stand):
    stand.leaves("killed")
    stand.daemon.kill()
    return nothing


def ended_by(number):
    def begin(stand):
        stand.leaves("asked to end")
        stand.daemon.process.send_signal(number)
        return nothing
    return begin


def stands_still(least, most=None):
    """As on a PC that is suspended or swaps; of a span of seconds the round's seed draws one."""
    def begin(stand):
        process = stand.daemon.process
        seconds = random.Random(f"still {stand.seed}").uniform(least, most or least)
        process.send_signal(signal.SIGSTOP)
        thaw = threading.Timer(seconds, lambda: process.send_signal(signal.SIGCONT))
        thaw.start()
        return thaw.join
    return begin


def thread_frozen(name):
    def begin(stand):
        found = freeze.threads(stand.pid)
        if name not in found:
            raise Unavailable(f"the daemon has no thread named {name}: {', '.join(found)}")
        try:
            return freeze.Frozen(found[name]).lift
        except PermissionError as trouble:
            raise Unavailable(f"{trouble}; ptrace is not allowed here") from trouble
    return begin


def clock_off(seconds):
    def begin(stand):
        stand.shim.set_clock_off(seconds)
        return nothing
    return begin


def second_daemon(stand):
    """Another one for the same rig, by a copy of its file, with a folder and a socket of its own."""
    folder = stand.folder / "second"
    folder.mkdir(exist_ok=True)
    copy = shutil.copy(stand.daemon.rig_file, folder / "copy.json")
    other = subprocess.Popen([os.environ["SHAKERD"], "--rig", str(copy), "--socket", str(folder / "s"),
                              "--data", str(folder / "data")],
                             stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)

    def lift():
        other.kill()
        other.wait()
    return lift


def out_of_memory(name, for_good, nth=None):
    """The nth allocation of a thread fails; without a number the round's seed draws one, small ones mostly."""
    def begin(stand):
        [thread] = freeze.threads(stand.pid)[name]
        drawn = nth or int(math.exp(random.Random(stand.seed).uniform(0.0, math.log(5000.0))))
        stand.shim.starve(thread, drawn, for_good)

        def lift():
            stand.reached = stand.reached or stand.shim.hits > 0
            stand.shim.lift()
        return lift
    return begin


# --- the disk

def disk(mode, code=0, left=-1):
    def begin(stand):
        stand.shim.order(mode, code, left)
        return stand.shim.lift
    return begin


def call_fails(nth, for_good):
    """The nth call on the daemon's files fails."""
    def begin(stand):
        stand.shim.fail_call(nth, for_good)

        def lift():
            stand.reached = stand.reached or stand.shim.hits > 0
            stand.shim.lift()
        return lift
    return begin


def disk_error(mode, name, left=-1):
    return disk(mode, shim.CODES[name], left)


def newest(stand):
    return max(stand.daemon.data.glob("*.db"), key=lambda path: path.stat().st_mtime_ns)


def database_deleted(stand):
    """Nothing can be proved of what was in it: it is excused from the comparison."""
    with contextlib.suppress(ValueError):
        file = newest(stand)
        for part in ("", "-wal", "-shm"):
            pathlib.Path(f"{file}{part}").unlink(missing_ok=True)
        stand.excused.add(file)
    return nothing


def log_damaged(damage):
    """kill -9, then something happens to the log before the daemon starts again."""
    def begin(stand):
        killed(stand)

        def lift():
            wal = next(iter(stand.daemon.data.glob("*.db-wal")), None)
            if wal and wal.stat().st_size:
                octets = damage(bytearray(wal.read_bytes()), random.Random(stand.seed))
                wal.write_bytes(octets)
                stand.damage(bytes(octets))
        return lift
    return begin


def flipped(octets, choose):
    octets[choose.randrange(len(octets))] ^= 1 << choose.randrange(8)
    return octets


def cut(octets, choose):
    """As a torn write leaves it: what was behind the cut cannot be known."""
    return octets[:choose.randrange(len(octets))]


def zeroed(octets, choose):
    at = choose.randrange(max(1, len(octets) // 2))
    octets[at:at + 4096] = bytes(len(octets[at:at + 4096]))
    return octets


def strange_files(stand):
    """What may lie in a data folder before the daemon starts."""
    data = stand.daemon.data
    data.mkdir(exist_ok=True)
    victim = stand.folder / "victim"
    victim.write_bytes(b"not the daemon's")
    os.symlink(victim, data / "link.db")
    os.mkfifo(data / "fifo.db")
    (data / "folder.db").mkdir()
    with contextlib.closing(sqlite3.connect(data / "future.db")) as future:
        future.execute("PRAGMA user_version = 1000")
        future.commit()

    def lift():
        assert victim.read_bytes() == b"not the daemon's", "a file behind a symbolic link was changed"
    return lift


# --- clients

def unix(stand):
    return lambda: crowd.connect(stand.daemon.socket)


def view(stand):
    return lambda: crowd.connect(stand.view)


def tcp(stand):
    port = stand.tcp_port()
    return lambda: crowd.connect_tcp(port)


def crowd_of(dial, count):
    return lambda stand: crowd.crowd(dial(stand), count)


def mob(kind, by, count):
    """In a process of its own; `by` is "unix", "view" or "tcp"."""
    def begin(stand):
        address = {"unix": stand.daemon.socket, "view": stand.view}.get(by) or stand.tcp_port()
        return crowd.mob(kind, address, count, stand.seed)
    return begin


def estop_by(dial):
    """Who may only listen."""
    def begin(stand):
        # Where all places are taken, the daemon closes the connection at once.
        with contextlib.closing(dial(stand)()) as link, contextlib.suppress(OSError):
            link.sendall(b'{"jsonrpc":"2.0","id":1,"method":"estop"}\n')
            link.recv(4096)
        return nothing
    return begin


def flipped_file(stand):
    return crowd.FlippedFile(stand.folder, stand.daemon.socket, campaign()).lift


def awkward_file(stand):
    path = crowd.many_keys(stand.folder)

    def work(link, ended, _):
        link.sendall(b'{"jsonrpc":"2.0","id":1,"method":"campaign.start","params":{"file":"%s"}}\n'
                     % str(path).encode())
        link.recv(1 << 16)
    return crowd.Streams(unix(stand), 1, work).lift


def operator_goes(stand):
    """The connection that is in control is closed; what it had seen stays remembered."""
    stand.watch_from_elsewhere()
    stand.witnesses[0].close()
    return nothing


def operator_is_silent(stand):
    stand.witness.hold_lease = False
    return nothing
