"""Every fault, what it must lead to, within what time, and why that time. One row each."""
from dataclasses import dataclass, field
from typing import Any, Callable

import acts
import crowd
import lies_drive as drive
import lies_sensor as sensor
import lies_wire as wire
import modbus_wire as modbus
import shim
from stand import ANSWER_S, DEADMAN_S, FREQUENCY_HZ, RAMP_S, STALE_S

# What a fault must lead to.
STOPS = "stops"  # the table is at rest within the bound, and stays so
GOES_ON = "goes on"  # the campaign does not notice, and a stop is heard as ever
ANY = "any"  # either, cleanly
REFUSED = "refused"  # nothing ever moves
STILL_MOVES = "still moves"  # nothing in software stops it: an alarm says so, again and again

# What bounds are made of, s.
ORDER = 0.3  # a turn of the exciter's thread, an exchange, a turn of the table's controller
FROZEN_S = 4 * STALE_S  # RAMP is four times as patient
DEAD = DEADMAN_S + 0.1  # the drive's own dead-man
DOWN = RAMP_S + ORDER  # from the decision to rest
SEEN = (3 + 2) / FREQUENCY_HZ  # three cycles; the one that was under way, and the one that is awaited
LEASE = 2.0
DISK = 2.0  # a call that has not come back is a failure from then on
CONFIRM = 2.0  # a drive that still says after a ramp that it moves is stopped at once
WATCHED = {"engine": 0.2, "acquisition": 0.5, "recorder": 2.0}  # a thread that is overdue


@dataclass(frozen=True)
class Fault:
    name: str
    effect: str
    bound_s: float
    why: str  # this bound
    begin: Callable[[Any], Callable[[], None]]
    moment: str = "motion"  # before the "daemon", the "campaign"; in a "ramp"; while it may "measure"
    by_cycles: bool = False  # only whole cycles show it: the bound counts from SETTLE on
    silent: bool = False  # no error alarm is owed: someone asked, or nobody is there to raise it
    alone: bool = False  # needs a stand of its own, or makes other faults' bounds meaningless
    stand: dict = field(default_factory=dict)
    waited_for: bool = False  # CHECK waits for the device: the campaign may go on when it is back
    heard: bool = False  # the thread that hears clients and signals does it
    orders: bool = False  # it orders another motion, in the midst of a ramp down too
    may_die: bool = False  # the daemon may end; then the dead-man stops the table
    open: str = ""  # what does not hold yet; the short form leaves it out


def over_the_wire():
    """The same on the exciter's wire and on the sensor's."""
    kinds = {
        "black_hole": lambda s: wire.BlackHole(), "late": lambda s: wire.Late(ANSWER_S + 0.1),
        "wrong_transaction": lambda s: wire.WrongTransaction(), "wrong_unit": lambda s: wire.WrongUnit(),
        "garbage": lambda s: wire.Garbage(s.seed), "short_frames": lambda s: wire.ShortFrames(),
        **{f"exception_{code}": lambda s, code=code: wire.Exceptions(code) for code in (4, 5, 6)}}
    for kind, rule in kinds.items():
        yield Fault(f"exciter_{kind}", STOPS, ANSWER_S + DEAD, "no beat gets through: the dead-man",
                    acts.on("exciter", rule), waited_for=True)
        yield Fault(f"sensor_{kind}", STOPS, STALE_S + ANSWER_S + DOWN, "stale, then a ramp",
                    acts.on("sensor", rule), waited_for=True)


def threads():
    for name, bound in WATCHED.items():
        yield Fault(f"thread_{name}", STOPS, bound + 1.0, "overdue: stopped within 1 s",
                    acts.thread_frozen(name), silent=name == "engine")


WIRES = [
    *over_the_wire(),
    Fault("exciter_reset", STOPS, ANSWER_S + DEAD + DOWN, "connected again and ramped down, or the dead-man",
          acts.reset("exciter"), waited_for=True),
    Fault("sensor_reset", ANY, 0, "a new connection may be quick enough", acts.reset("sensor")),
    Fault("exciter_one_lost", ANY, 0, "one answer more or less", acts.on("exciter", lambda s: wire.OneLost())),
    Fault("sensor_one_lost", ANY, 0, "one answer more or less", acts.on("sensor", lambda s: wire.OneLost())),
    Fault("rig_stopped", STOPS, 1.0 + DEAD + ORDER, "stands still for 1 s; then its dead-man",
          acts.rig_stands_still, alone=True, waited_for=True),
    Fault("rig_killed", STOPS, ORDER, "the table is gone", acts.rig_dies, alone=True),
]


def at_times(factor):
    """A table at this part of the frequency, and a drive that says what it was told."""
    return acts.moves_otherwise(lambda: drive.other_frequency(factor, hides=True), **acts.hurries(factor))


DRIVE = [
    Fault("drive_trips", STOPS, ORDER, "the drive stops by itself", acts.rig_fault(modbus.EXCITER_TRIP)),
    Fault("drive_deaf", STOPS, SEEN + DOWN, "it stands still, and says that it runs: the accelerometer",
          acts.rig_fault(modbus.EXCITER_DEAF), by_cycles=True),
    Fault("stop_refused", STOPS, DOWN + CONFIRM + DEAD, "no confirmed ramp, no beat: the dead-man",
          acts.stop_with(drive.RefusesStop), alone=True),
    Fault("stop_ignored", STOPS, DOWN + CONFIRM + DEAD, "no confirmed ramp, no beat: the dead-man",
          acts.stop_with(lambda: drive.IgnoresStop(lies=False)), alone=True),
    Fault("stop_denied", STOPS, DOWN + CONFIRM + DEAD, "the accelerometer confirms no rest: the dead-man",
          acts.stop_with(lambda: drive.IgnoresStop(lies=True)), alone=True),
    Fault("stop_refused_no_dead_man", STILL_MOVES, DOWN + CONFIRM + ORDER, "after the last order failed",
          acts.stop_with(drive.RefusesStop, dead_man_works=False),
          moment="measure", alone=True),
    Fault("stop_ignored_no_dead_man", STILL_MOVES, DOWN + CONFIRM + ORDER, "after the last order failed",
          acts.stop_with(lambda: drive.IgnoresStop(lies=False), dead_man_works=False),
          moment="measure", alone=True),
    Fault("stop_denied_no_dead_man", STILL_MOVES, DOWN + CONFIRM + 0.5 + ORDER,
          "the accelerometer shows it in 0.5 s",
          acts.stop_with(lambda: drive.IgnoresStop(lies=True), dead_man_works=False),
          moment="measure", alone=True),
    Fault("amplitude_doubled", STOPS, SEEN + DOWN, "the accelerometer shows it",
          acts.moves_otherwise(lambda: drive.doubled_amplitude(hides=True), **acts.doubles),
          by_cycles=True, orders=True),
    Fault("frequency_changed", STOPS, SEEN + DOWN, "the accelerometer shows it", at_times(1.8), by_cycles=True,
          orders=True),
    Fault("frequency_halved", STOPS, SEEN + DOWN, "the accelerometer shows it", at_times(0.5), by_cycles=True,
          orders=True),
    Fault("frequency_a_tenth_off", STOPS, SEEN + DOWN, "the accelerometer shows it", at_times(1.1), by_cycles=True,
          orders=True),
    Fault("amplitude_doubled_unmeasured", STOPS, SEEN + DOWN, "the drive itself says so",
          acts.moves_otherwise(lambda: drive.doubled_amplitude(hides=False), **acts.doubles),
          alone=True, stand={"measured": False}, by_cycles=True),
    Fault("frequency_changed_unmeasured", STOPS, SEEN + DOWN, "the drive itself says so",
          acts.moves_otherwise(lambda: drive.other_frequency(1.8, hides=False), **acts.hurries(1.8)),
          alone=True, stand={"measured": False}, by_cycles=True),
    Fault("dead_man_off", REFUSED, 0, "the self check asks for one", lambda s: acts.nothing,
          moment="campaign", alone=True, stand={"dead_man_s": 0}),
    Fault("dead_man_60_s", REFUSED, 0, "the self check asks for a short one", lambda s: acts.nothing,
          moment="campaign", alone=True, stand={"dead_man_s": 60}),
]


def said(stroke=None, excitation=None):
    """The sensor's values go through these; each is made anew for a stand."""
    return acts.on("sensor", lambda s: sensor.Sensor(stroke and stroke(s), excitation and excitation(s)))


SENSOR = [
    Fault("stroke_frozen", STOPS, FROZEN_S + DOWN, "as long as stale_s, in RAMP four times that",
          said(lambda s: sensor.Frozen())),
    Fault("stroke_nan", STOPS, STALE_S + DOWN, "no good value: stale", said(lambda s: sensor.not_a_number)),
    Fault("stroke_offset", STOPS, SEEN + DOWN, "beyond the limit, or a jump",
          said(lambda s: lambda u: u + 0.03), by_cycles=True),
    Fault("stroke_huge", STOPS, SEEN + DOWN, "beyond the limit",
          said(lambda s: lambda u: 3e38), by_cycles=True),
    Fault("stroke_negative", STOPS, SEEN + DOWN, "beyond the limit",
          said(lambda s: lambda u: -u), by_cycles=True),
    Fault("stroke_inverted", STOPS, SEEN + DOWN, "the response has changed its sign",
          said(lambda s: sensor.ScaledAboutItsMiddle(-1.0)), by_cycles=True, moment="measure"),
    Fault("stroke_negative_from_start", REFUSED, 0, "beyond the limit at rest",
          said(lambda s: lambda u: -u), moment="campaign", alone=True),
    Fault("stroke_halved", STOPS, SEEN + DOWN, "the response has halved",
          said(lambda s: sensor.ScaledAboutItsMiddle(0.5)), by_cycles=True, moment="measure"),
    Fault("stroke_stuck_noisy", STOPS, SEEN + DOWN, "the response has gone",
          said(lambda s: sensor.StuckButNoisy(s.seed)), by_cycles=True, moment="measure"),
    Fault("stroke_spikes", STOPS, SEEN + DOWN, "one in each cycle is no single wild sample",
          said(lambda s: sensor.SpikeEachCycle(1 / FREQUENCY_HZ)), by_cycles=True),
    Fault("stroke_frozen_in_ramp", STOPS, FROZEN_S + 3.0 + DOWN, "seen, then the long ramp back",
          said(lambda s: sensor.Frozen()), moment="ramp", alone=True, stand={"ramp_s": 3.0}),
    Fault("excitation_nan", STOPS, STALE_S + DOWN, "no good value: stale",
          said(excitation=lambda s: sensor.not_a_number)),
    Fault("excitation_frozen", STOPS, SEEN + DOWN, "the table seems to rest",
          said(excitation=lambda s: sensor.Frozen()), by_cycles=True),
    Fault("block_repeated", STOPS, STALE_S + DOWN, "nothing new: stale",
          acts.on("sensor", lambda s: sensor.RepeatedBlock())),
]

PROCESS = [
    *threads(),
    Fault("thread_exciter", STOPS, DEAD, "no beat: the dead-man", acts.thread_frozen("exciter")),
    Fault("thread_estimator", ANY, 0, "it moves nothing", acts.thread_frozen("estimator")),
    Fault("thread_log", GOES_ON, 0, "nobody waits for the log", acts.thread_frozen("shakerd")),
    Fault("thread_main", STOPS, LEASE + DOWN + 0.5, "no stop is heard: the lease runs out",
          acts.thread_frozen("main"), silent=True),
    Fault("killed", STOPS, DEAD, "no beat: the dead-man", acts.killed, silent=True),
    Fault("stopped_0_3_s", ANY, 0, "shorter than the dead-man", acts.stands_still(0.3)),
    Fault("stopped_1_s", STOPS, DEAD, "no beat: the dead-man", acts.stands_still(1.0)),
    Fault("stopped_0_3_to_3_s", ANY, 0, "shorter than the dead-man, or not: cleanly", acts.stands_still(0.3, 3.0)),
    Fault("stopped_4_s", STOPS, DEAD, "no beat: the dead-man", acts.stands_still(4.0)),
    Fault("sigterm", STOPS, DOWN, "ramps down and leaves", acts.ended_by(15), silent=True, heard=True),
    Fault("sigint", STOPS, DOWN, "ramps down and leaves", acts.ended_by(2), silent=True, heard=True),
    Fault("second_daemon", GOES_ON, 0, "it is refused the rig", acts.second_daemon),
    *(Fault(f"clock_{name}", GOES_ON, 0, "nothing is timed by it", acts.clock_off(seconds))
      for name, seconds in {"day_on": 86400.0, "day_back": -86400.0, "year_back": -400 * 86400.0,
                            "years_on": 30 * 365.25 * 86400.0}.items()),
]

MEMORY = [
    Fault(f"memory_{'publisher' if thread == 'main' else thread}_{'for_good' if for_good else 'once'}", ANY, 0,
          "it goes on, stops, or ends: the dead-man", acts.out_of_memory(thread, for_good), may_die=True,
          silent=True, alone=True)
    for thread in ("recorder", "estimator", "engine", "exciter", "acquisition", "main") for for_good in (False, True)]

DISK_FAULTS = [
    Fault("flush_hangs", STOPS, DISK + DOWN, "as long as a call may take", acts.disk(shim.FLUSH_HANGS)),
    Fault("mount_hangs", STOPS, DISK + DOWN, "as long as a call may take", acts.disk(shim.MOUNT_HANGS)),
    *(Fault(f"{call}_{code}{'_once' if left > 0 else ''}", STOPS, DISK + DOWN, "the next call",
            acts.disk_error(mode, code, left))
      for call, mode in (("flush", shim.FLUSH_FAILS), ("write", shim.WRITE_FAILS))
      for code, left in (("EIO", -1), ("EIO", 1), ("ENOSPC", -1), ("EDQUOT", -1), ("EROFS", -1))),
    Fault("disk_full_at_start", REFUSED, 0, "nothing is measured that cannot be kept",
          acts.disk_error(shim.WRITE_FAILS, "ENOSPC"), moment="campaign", alone=True),
    Fault("database_deleted", STOPS, DISK + DOWN, "looked at each second", acts.database_deleted, alone=True),
    *(Fault(f"log_{name}", STOPS, DEAD, "killed: the dead-man", acts.log_damaged(damage), silent=True,
            alone=True)
      for name, damage in (("bit_flipped", acts.flipped), ("cut", acts.cut), ("zeroed", acts.zeroed))),
    Fault("strange_files", GOES_ON, 0, "they are not the daemon's", acts.strange_files, moment="daemon"),
]

CLIENTS = [
    Fault("clients_200", GOES_ON, 0, "places are kept for a stop", acts.crowd_of(acts.unix, 200)),
    Fault("listeners_20", GOES_ON, 0, "places are kept for a stop", acts.crowd_of(acts.tcp, 20)),
    Fault("half_open", GOES_ON, 0, "a line that never ends", lambda s: crowd.half_open(s.daemon.socket)),
    Fault("rubbish", GOES_ON, 0, "each has its error code", acts.mob("rubbish", "unix", 4)),
    Fault("never_read", GOES_ON, 0, "told, and dropped", acts.mob("never_reads", "unix", 8)),
    Fault("flood", GOES_ON, 0, "served, not obeyed", acts.mob("floods", "unix", 8)),
    Fault("flood_by_listeners", GOES_ON, 0, "served, not obeyed", acts.mob("floods", "tcp", 8)),
    Fault("listener_stops", GOES_ON, 0, "who listens may not command", acts.estop_by(acts.tcp)),
    Fault("onlookers_200", GOES_ON, 0, "places are kept for a stop", acts.crowd_of(acts.view, 200)),
    Fault("onlookers_never_look", GOES_ON, 0, "told, and dropped", acts.mob("never_looks", "view", 8)),
    Fault("flood_by_onlookers", GOES_ON, 0, "served, not obeyed", acts.mob("floods", "view", 8)),
    Fault("rubbish_by_onlookers", GOES_ON, 0, "each has its error code", acts.mob("rubbish", "view", 4)),
    Fault("onlooker_stops", GOES_ON, 0, "who looks on may not command", acts.estop_by(acts.view)),
    Fault("flipped_file", GOES_ON, 0, "no file is waited for", acts.flipped_file),
    Fault("awkward_file", GOES_ON, 0, "no file is read at the engine's cost", acts.awkward_file),
    Fault("operator_gone", STOPS, DOWN, "nobody is in control", acts.operator_goes, silent=True, heard=True),
    Fault("lease_lost", STOPS, LEASE + DOWN, "the lease runs out", acts.operator_is_silent, silent=True, heard=True),
]

TABLE = {fault.name: fault for fault in
         (*WIRES, *DRIVE, *SENSOR, *PROCESS, *MEMORY, *DISK_FAULTS, *CLIENTS)}


def choose(choose_by, table, most=5):
    """The faults of one random round: one to five that go together, or one that goes alone."""
    first = choose_by.choice(sorted(table))
    if table[first].alone:
        return [first]
    others = [name for name in sorted(table) if name != first and not table[name].alone]
    return [first, *choose_by.sample(others, min(choose_by.randrange(most), len(others)))]
