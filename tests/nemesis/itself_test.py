"""The tools tell the truth: what the observer, the witness and the lies do, without a daemon."""
import contextlib
import json
import pathlib
import socket
import sqlite3
import struct
import sys
import tempfile
import threading
import unittest
import unittest.mock

import places  # noqa: F401  first: it says where the others are
import acts
import crowd
import freeze
import ledger
import lies_drive
import lies_sensor
import modbus_wire as modbus
from daemon import Client, Program
from observer import Observer, Queue, Reading
from table import ANY, GOES_ON, REFUSED, STILL_MOVES, STOPS, TABLE
from witness import missing


def write(address, words):
    count = len(words)
    return modbus.Frame(7, 1, struct.pack(f">BHHB{count}H", 16, address, count, 2 * count, *words))


def read(function, address, count, unit=1):
    return modbus.Frame(8, unit, struct.pack(">BHH", function, address, count))


def answer(request, words):
    return request.with_pdu(struct.pack(f">BB{len(words)}H", request.function, 2 * len(words), *words))


class Freeze(unittest.TestCase):
    def test_a_frozen_program_has_not_ended(self):
        program = Program([sys.executable, "-c", "import time; time.sleep(60)"])
        self.addCleanup(program.wait)
        self.addCleanup(program.kill)
        try:
            freeze.Frozen([program.pid]).lift()
        except PermissionError as trouble:
            self.skipTest(f"{trouble}; ptrace is not allowed here")
        polls, enough = [], threading.Event()

        def poll():
            while not enough.is_set():
                polls.append(program.poll())

        polling = threading.Thread(target=poll)
        polling.start()
        try:
            for _ in range(100):
                freeze.Frozen([program.pid]).lift()
        finally:
            enough.set()
            polling.join()
        self.assertEqual(set(polls), {None})

    def test_a_program_that_another_thread_waits_for_has_ended(self):
        program = Program([sys.executable, "-c", "raise SystemExit(3)"])
        trouble, enough = [], threading.Event()

        def poll():
            while not enough.is_set():
                try:
                    program.poll()
                except OSError as error:
                    trouble.append(error)

        polling = [threading.Thread(target=poll) for _ in range(4)]
        for thread in polling:
            thread.start()
        status = program.wait()
        enough.set()
        for thread in polling:
            thread.join()
        self.assertEqual((status, trouble), (3, []))


class Death(unittest.TestCase):
    def test_an_observer_that_has_died_vouches_for_nothing(self):
        def others():
            raise ChildProcessError

        with unittest.mock.patch("threading.excepthook"):  # it prints
            observer = Observer(1, others)  # nobody listens there
            observer.join(5)
        self.assertRaises(RuntimeError, observer.moving, 0.0)


class Wire(unittest.TestCase):
    def test_a_frame_is_what_the_specification_prints(self):
        # Modbus Messaging Implementation Guide V1.0b, annex A: read one register, unit 0xFF.
        frame = modbus.Frame(0x1501, 0xFF, b"\x04\x00\x04\x00\x01")
        self.assertEqual(frame.encode(), b"\x15\x01\x00\x00\x00\x06\xff\x04\x00\x04\x00\x01")

    def test_written_words_can_be_changed(self):
        request = write(0, [1, 2, 3])
        self.assertEqual(request.written(), {0: 1, 1: 2, 2: 3})
        self.assertEqual(request.with_written({0: 1, 1: 9, 2: 3}).written()[1], 9)


class Connecting(unittest.TestCase):
    def test_a_listener_that_accepts_nobody_does_not_hold_a_client(self):
        with tempfile.TemporaryDirectory() as folder, contextlib.ExitStack() as links:
            path = pathlib.Path(folder) / "s.sock"
            listener = links.enter_context(socket.socket(socket.AF_UNIX, socket.SOCK_STREAM))
            listener.bind(str(path))
            listener.listen(0)
            with self.assertRaises(OSError):
                for _ in range(10):
                    links.enter_context(contextlib.closing(Client(path, patience=0.1)))


class Crowd(unittest.TestCase):
    def test_who_finds_the_queue_full_asks_again(self):
        with tempfile.TemporaryDirectory() as folder, socket.socket(socket.AF_UNIX) as listener:
            path = pathlib.Path(folder) / "s"
            listener.bind(str(path))
            listener.listen(0)
            held = []
            with contextlib.suppress(BlockingIOError):
                while True:
                    held.append(crowd.connect(path, 0.0))
            threading.Timer(0.2, lambda: held.append(listener.accept()[0])).start()
            held.append(crowd.connect(path))
            for link in held:
                link.close()


class Ports(unittest.TestCase):
    def test_the_port_of_a_killed_rig_is_given_to_no_other(self):
        with socket.create_server(("127.0.0.1", 0)) as rig:
            port = rig.getsockname()[1]
            client = socket.create_connection(("127.0.0.1", port))
            rig.accept()[0].close()
        with contextlib.closing(client), contextlib.closing(acts.held(port)):
            with self.assertRaises(OSError), socket.create_server(("127.0.0.1", port)):
                pass
            with self.assertRaises(ConnectionRefusedError):
                socket.create_connection(("127.0.0.1", port))


class Drive(unittest.TestCase):
    def test_a_stop_is_told_from_another_order(self):
        self.assertTrue(lies_drive.is_stop(write(modbus.ENABLE, [0])))
        self.assertTrue(lies_drive.is_stop(write(modbus.AMPLITUDE, [0, 0])))
        self.assertFalse(lies_drive.is_stop(write(modbus.AMPLITUDE, modbus.f32_words(3.0))))
        self.assertFalse(lies_drive.is_stop(write(modbus.HEARTBEAT, [0])))

    def test_an_ignored_stop_reads_back_as_done(self):
        drive = lies_drive.IgnoresStop(lies=True)
        self.assertIsNone(drive.reply(write(modbus.HEARTBEAT, [3])))
        self.assertEqual(drive.reply(write(modbus.ENABLE, [0])).pdu, write(modbus.ENABLE, [0]).pdu[:5])
        held = read(3, 4, 1)
        self.assertEqual(drive.answer(held, answer(held, [1])).read_words(), [0])
        status = read(4, 0, 6)
        said = drive.answer(status, answer(status, [3, 0, 1, 2, *modbus.f32_words(3.0)])).read_words()
        self.assertEqual(said[modbus.STATUS], 2)
        self.assertEqual(modbus.f32(said[4:6]), 0.0)

    def test_a_doubled_amplitude_reads_back_as_written(self):
        drive = lies_drive.doubled_amplitude(hides=False)
        sent = drive.request(write(modbus.AMPLITUDE, modbus.f32_words(3.0))).written()
        self.assertEqual(modbus.f32([sent[2], sent[3]]), 6.0)
        held = read(3, 2, 2)
        self.assertEqual(
            modbus.f32(drive.answer(held, answer(held, modbus.f32_words(6.0))).read_words()), 3.0)
        status = read(4, 4, 2)
        self.assertEqual(
            modbus.f32(drive.answer(status, answer(status, modbus.f32_words(6.0))).read_words()), 6.0)

    def test_one_that_hides_says_what_it_was_told_on_the_way_too(self):
        for drive, register, at, true, told in (
                (lies_drive.other_frequency(1.1, hides=True), modbus.FREQUENCY, modbus.FREQUENCY_NOW, 4.1, 4.0),
                (lies_drive.doubled_amplitude(hides=True), modbus.AMPLITUDE, modbus.AMPLITUDE_NOW, 3.2, 3.0)):
            drive.request(write(register, modbus.f32_words(told)))
            status = read(4, at, 2)
            self.assertEqual(
                modbus.f32(drive.answer(status, answer(status, modbus.f32_words(true))).read_words()), told)

    def test_a_doubled_amplitude_that_hides_goes_down_with_the_table(self):
        drive = lies_drive.doubled_amplitude(hides=True)
        drive.request(write(modbus.AMPLITUDE, modbus.f32_words(0.0)))
        status = read(4, modbus.AMPLITUDE_NOW, 2)
        self.assertEqual(modbus.f32(drive.answer(status, answer(status, modbus.f32_words(2.0))).read_words()), 1.0)


class Sensor(unittest.TestCase):
    def test_only_the_stroke_is_changed(self):
        rule = lies_sensor.Sensor(stroke=lambda u: u + 1.0)
        asked = read(4, 6, 4, unit=2)
        words = rule.answer(asked, answer(asked, modbus.f32_words(0.5) + modbus.f32_words(2.0))).read_words()
        self.assertEqual((modbus.f32(words[:2]), modbus.f32(words[2:])), (1.5, 2.0))

    def test_a_stuck_one_is_noisy_and_stuck(self):
        stuck = lies_sensor.StuckButNoisy(1)
        values = [stuck(0.1), *(stuck(u) for u in (0.2, 0.3, 0.4))]
        self.assertTrue(all(abs(v - 0.1) < 2e-4 for v in values))
        self.assertEqual(len(set(values)), 4)


class Judges(unittest.TestCase):
    def test_the_observer_sees_motion_and_its_own_lateness(self):
        observer = object.__new__(Observer)
        observer.queue, observer.ended = Queue(), threading.Event()
        observer.readings = [Reading(0.01 * i, True, 5.0, 3.0 if i < 50 else 0.0) for i in range(100)]
        del observer.readings[60:80]
        self.assertEqual(len(observer.moving(0.2, 10.0)), 30)
        self.assertAlmostEqual(observer.lateness(0.0, 0.99), 0.21 - 0.05, places=6)
        self.assertAlmostEqual(observer.lateness(0.65, 0.7), 0.21 - 0.05, places=6)  # it overlaps
        self.assertEqual(observer.lateness(0.0, 0.5), 0.0)
        observer.queue.waits = [(0.3, 0.09), (0.4, 0.01), (2.0, 1.0)]
        self.assertAlmostEqual(observer.lateness(0.0, 0.5), 0.07, places=6)

    def test_what_is_in_no_file_is_missed(self):
        with tempfile.TemporaryDirectory() as folder:
            file = pathlib.Path(folder) / "a.db"
            cycle = {"type": "cycle", "seq": 5, "run": "long", "cycle": 3, "accepted": True}
            estimate = {"type": "estimate", "seq": 6, "run": "long"}
            acknowledged = [(line, json.dumps(line)) for line in (cycle, estimate)]
            with contextlib.closing(sqlite3.connect(file)) as database:
                database.execute("CREATE TABLE document(seq, line)")
                database.execute("CREATE TABLE cycle(run, idx, accepted)")
                database.execute("INSERT INTO document VALUES(5, ?)", (acknowledged[0][1],))
                database.commit()
                self.assertEqual(len(missing(acknowledged, [file])), 2)
                database.execute("INSERT INTO cycle VALUES(0, 3, 1)")
                database.execute("INSERT INTO document VALUES(6, ?)", (acknowledged[1][1],))
                database.commit()
                self.assertEqual(missing(acknowledged, [file]), [])

    def test_each_fault_says_what_it_must_lead_to(self):
        for fault in TABLE.values():
            self.assertIn(fault.effect, (STOPS, GOES_ON, ANY, REFUSED, STILL_MOVES), fault.name)
            self.assertEqual(fault.bound_s > 0, fault.effect in (STOPS, STILL_MOVES), fault.name)
            self.assertTrue(fault.why, fault.name)


class Ledger(unittest.TestCase):
    def test_comments_and_blanks_make_no_other_code(self):
        one = ledger.digest({"a.cpp": 'int f(int x) { // it\'s x\n  return x + 1\'000; /* \n " */ }\n'})
        self.assertEqual(one, ledger.digest({"a.cpp": "int f(int x)\n{ return x+1'000; }"}))
        self.assertNotEqual(one, ledger.digest({"a.cpp": "int f(int x) { return x - 1'000; }"}))
        self.assertNotEqual(one, ledger.digest({"b.cpp": "int f(int x) { return x+1'000; }"}))

    def test_what_a_string_says_counts(self):
        for other in ('"a  // b"', '"a // c"', "'\"'; // b", 'R"(a // b)"', 'R"x(a" // b)x"'):
            self.assertNotEqual(ledger.essence('"a // b"'), ledger.essence(other))
        self.assertEqual(ledger.essence('R"x(a" // b)x"; // c'), 'R"x(a" // b)x";')
        self.assertEqual(ledger.essence("'\"' /* \" */ '\\'' // '"), "'\"''\\''")

    def test_code_that_was_judged_equal_counts_and_no_other(self):
        def judged(room, newer, older):
            return {"room": room, "code": newer, "equals": older, "why": ""}

        present = {"daemon": "d1", "record": "r3"}
        chain = [judged("record", "r2", "r1"), judged("daemon", "d9", "d0"), judged("record", "r3", "r2")]
        self.assertEqual(ledger.equals(present, chain), {"daemon": ["d1"], "record": ["r3", "r2", "r1"]})

    def test_the_files_of_each_room_are_found(self):
        for room in ledger.ROOMS:
            self.assertGreater(len(ledger.committed(room)), 10, room)


if __name__ == "__main__":
    unittest.main()
