"""One round: a campaign, one to five faults at random moments, and what must hold whatever they are."""
import contextlib
import random
import subprocess
import time
from dataclasses import dataclass, field

import acts
from daemon import Client
from stand import Stand
from table import DEAD, GOES_ON, ORDER, REFUSED, STILL_MOVES, STOPS, TABLE
from witness import missing

REST = ("IDLE", "CHECK", "FAULT", "PAUSE")
MAY_MOVE = "may still be moving"
SAID_AGAIN_S = 6.0
AFTERWARDS_S = 1.0  # for which nothing may move by itself once every fault is lifted
WAIT_MOTION_S = 12.0
BUSY_S = 0.15  # the daemon's own bounds are of that size


class Undecided(Exception):
    """What was seen says nothing of the daemon; the sentence says why."""


@dataclass
class Result:
    seed: str
    faults: list
    violations: list = field(default_factory=list)
    skipped: str = ""  # why it could not be tried
    undecided: str = ""  # why what was seen says nothing of the daemon
    reached: bool = False  # the allocation or the call that had to fail
    died: bool = False  # the daemon ended by itself, as it may
    acknowledged: int = 0
    to_rest: dict = field(default_factory=dict)  # fault: s, of the first that stopped the table
    story: list = field(default_factory=list)


class Round:
    def __init__(self, seed, names, library, slack_s):
        self.random = random.Random(seed)
        self.faults = [TABLE[name] for name in names]
        self.library, self.slack_s = library, slack_s
        self.result = Result(seed, names)
        self.begun, self.lifts = [], []  # (fault, time)
        self.asked = float("inf")  # when this test asked for a stop: an emergency stop is an alarm

    def run(self):
        more = {key: value for fault in self.faults for key, value in fault.stand.items()}
        self.stand = Stand(self.result.seed, self.library, **more)
        self.made = time.monotonic()
        try:
            self.play()
        except acts.Unavailable as why:
            self.result.skipped = str(why)
        except Undecided as why:
            self.result.undecided = str(why)
        except AssertionError as trouble:
            told = self.late if str(trouble).startswith("timeout") else self.wrong
            told(f"the daemon did not do as it should: {str(trouble)[:600]}")
        except subprocess.TimeoutExpired as trouble:
            self.late(f"the daemon did not end within {trouble.timeout:g} s", trouble.timeout / 3)
        except OSError as trouble:  # the rig is no fault of the daemon's; it may be this machine's
            self.late(f"the rig did not answer the test itself: {trouble}")
        finally:
            self.lift()
            if self.result.violations:
                self.tell()
            self.stand.close()
        return self.result

    def wrong(self, sentence):
        self.result.violations.append(sentence)

    def late(self, sentence, busy_s=BUSY_S):
        """Wrong too, unless this machine was so busy that it kept even the observer waiting."""
        since = self.begun[0][1] - 1.0 if self.begun else self.made
        waited = self.stand.observer.lateness(since, time.monotonic())
        if waited < busy_s:
            self.wrong(sentence)
        else:
            self.result.undecided = f"the observer had to wait for {waited:.1f} s: {sentence}"

    def begin(self, moment):
        for fault in self.faults:
            if fault.moment == moment:
                self.begin_one(fault)

    def begin_one(self, fault):
        self.begun.append((fault, time.monotonic()))
        try:
            self.lifts.append(fault.begin(self.stand))
        except OSError:
            if not self.stand.left:
                raise
            self.begun.pop()  # an earlier fault has left nothing that this one could be done to

    def lift(self):
        while self.lifts:
            with contextlib.suppress(OSError):
                self.lifts.pop()()

    # --- what happens

    def play(self):
        self.begin("daemon")
        self.stand.start_daemon()
        # What the daemon says at its start of what it found is no alarm of the campaign.
        self.begun = [(fault, time.monotonic()) for fault, _ in self.begun]
        self.begin("campaign")
        if any(fault.effect == REFUSED for fault in self.faults):
            return self.refused()
        self.stand.begin_campaign()
        if any(fault.moment == "ramp" for fault in self.faults):
            self.stand.witness.until_state("RAMP", timeout=WAIT_MOTION_S)
            time.sleep(0.3 + 0.5 * self.random.random())
            self.begin("ramp")
        elif all(fault.moment != "campaign" for fault in self.faults):
            self.wait_for_a_moment()
        for fault in self.random.sample(self.faults, len(self.faults)):
            if fault.moment in ("motion", "measure"):
                self.begin_one(fault)
                time.sleep(self.random.choice((0.0, 0.3, 1.0)) * self.random.random())
        self.await_outcome()
        self.look_after()

    def wait_for_a_moment(self):
        """Mostly while cycles are measured; now and then at rest, or while it grows."""
        state = self.random.choices(("CHECK", "RAMP", "SETTLE", "MEASURE"), (1, 2, 2, 10))[0]
        if any(fault.moment == "measure" for fault in self.faults):
            state = "MEASURE"
        with contextlib.suppress(AssertionError):  # not so far yet, or over: a busy machine, see `ended`
            self.stand.witness.until_state(state, "MEASURE", "RAMP_DOWN", "FAULT", timeout=WAIT_MOTION_S)
        time.sleep(1.0 * self.random.random())
        ended = self.states()[-1]
        if ended[1] in ("IDLE", "FAULT", "RAMP_DOWN"):
            waited = self.stand.observer.lateness(ended[0] - 2.0, ended[0] + 0.5)
            sentence = f"the campaign was over before a fault was done: {ended[2]}"
            if waited < 0.02:
                raise AssertionError(sentence)
            raise Undecided(f"the observer had to wait for {waited:.2f} s: {sentence}")

    def refused(self):
        """Whatever the answer to the start: nothing moves, and one error says why."""
        self.stand.witness.ask("control.acquire")
        answer = self.stand.witness.ask("campaign.start", {"campaign": acts.campaign()})
        self.stand.witness.renewing = True
        end = time.monotonic() + WAIT_MOTION_S
        while time.monotonic() < end and not self.stand.observer.moving(0.0) and not self.refused_now():
            time.sleep(0.05)
        moved = self.stand.observer.moving(0.0)
        if moved:
            self.wrong(f"the table moved {moved[0].amplitude:.2f} m/s^2; the campaign was to be refused")
        time.sleep(0.3)  # what is said of it
        if "error" not in answer and len(self.errors(0.0)) != 1:  # `late`: the lease may be lost in CHECK
            self.late(f"{len(self.errors(0.0))} error alarms tell why it was refused, not one")
        self.look_after()

    def refused_now(self):
        states = [state for _, state, _ in self.states()]
        return "CHECK" in states and states[-1] == "IDLE"

    def since(self, fault, began):
        """From when its bound counts: it moves, and where cycles are needed they are cut; None: not yet."""
        first = self.stand.observer.moving(began)
        if not first:
            return None
        if not fault.by_cycles:
            return first[0].t
        states = [(t, state) for t, state, _ in self.states()]
        cut = [max(t, began) for (t, state), (left, _) in zip(states, [*states[1:], (float("inf"), "")])
               if state in ("SETTLE", "MEASURE") and left > began]
        return cut[0] if cut else None

    def deadline(self):
        """The first of the bounds, for each fault alone stops it; not before that of one that orders a motion."""
        deaf = any(fault.name == "thread_main" for fault, _ in self.begun)
        ends = [since + fault.bound_s for fault, began in self.begun
                if fault.effect == STOPS and not (fault.heard and deaf)
                and not (fault.waited_for and self.in_check(began))
                and (since := self.since(fault, began)) is not None]
        return self.slack_s + max([min(ends), *(t + f.bound_s for f, t in self.begun if f.orders)]) if ends else None

    def await_outcome(self):
        if any(fault.effect == STILL_MOVES for fault in self.faults):
            return self.await_alarm()
        stopping = [began for fault, began in self.begun if fault.effect == STOPS]
        if not stopping:
            time.sleep(1.5)
            self.at_rest_if_dead()
            return None if self.at_rest() and self.over() else self.stop_as_anyone()
        self.await_rest(min(stopping))

    def await_rest(self, since):
        observer, give_up = self.stand.observer, time.monotonic() + WAIT_MOTION_S
        while time.monotonic() < give_up:
            end = self.deadline()
            if not end and not self.at_rest() and self.under_way():
                return
            if end:
                end += observer.lateness(since, time.monotonic())
                if time.monotonic() > end:
                    break
            elif self.at_rest() and self.over():
                return  # it never began to move
            time.sleep(0.02)
        end = end or give_up
        moving = observer.moving(end - 0.05)
        if moving:
            self.late(f"the table moves {moving[-1].amplitude:.2f} m/s^2, {moving[-1].t - since:.2f} s after "
                      f"{self.named()}; it had to rest within {end - since:.2f} s")
            time.sleep(3.0)  # how long, is worth knowing
        moved = observer.moving(since)
        if moved:
            self.result.to_rest[self.faults[0].name] = moved[-1].t - moved[0].t

    def at_rest_if_dead(self):
        """A daemon that has ended by itself sends no beat: the dead-man stops the table."""
        if not any(fault.may_die for fault in self.faults) or self.stand.daemon.process.poll() is None:
            return False
        self.stand.leaves("killed")
        self.result.died = True
        if not self.comes_to_rest(DEAD + ORDER):  # it may have ended just now
            self.late(f"the daemon has ended after {self.named()}, and the table moves")
        return True

    def over(self):
        """No campaign is under way, or nobody is there who could run one."""
        return self.stand.left or self.stand.witness.closed or self.states()[-1][1] in ("IDLE", "FAULT")

    def at_rest(self):
        return not ((reading := self.stand.observer.last()) and reading.moves)

    def comes_to_rest(self, within_s):
        end = (now := time.monotonic()) + within_s
        while not self.at_rest() and time.monotonic() < end + self.stand.observer.lateness(now, end):
            time.sleep(0.02)
        return self.at_rest()

    def stop_as_anyone(self):
        """Where the campaign goes on it was not disturbed, and a stop from another terminal is heard."""
        harmless = all(fault.effect == GOES_ON for fault in self.faults)
        if harmless:
            state = self.stand.witness.states()[-1][1]
            if state not in ("RAMP", "SETTLE", "MEASURE", "CHECK"):
                self.late(f"the campaign ended in {state}, although {self.named()} is harmless")
            for alarm in self.errors(self.begun[0][1]):
                self.late(f"an alarm for {self.named()}, which is harmless: {alarm['code']}: {alarm['text']}")
        self.asked = time.monotonic()
        status, said = self.stand.shakerctl(self.random.choice(("stop", "estop")))
        if status != 0 and not any(fault.may_die for fault in self.faults):
            self.late(f"shakerctl was not heard beside {self.named()}: {said.strip()[-200:]}")
            return
        if not self.comes_to_rest(1.0 + self.slack_s):
            self.late(f"a stop beside {self.named()} was acknowledged and not done")

    def await_alarm(self):
        """The table cannot be stopped. What is left is to say so, and to say it again."""
        fault, began = self.begun[-1]
        end = began + fault.bound_s + self.slack_s
        said = lambda: [a for a in self.stand.witness.alarms(began) if MAY_MOVE in a["text"]]
        while time.monotonic() < end and not said():
            time.sleep(0.02)
        if not said():
            return self.late(f"no alarm says within {end - began:.1f} s that the table may still be moving, "
                             f"after {fault.name}")
        again = time.monotonic() + SAID_AGAIN_S + self.slack_s
        while time.monotonic() < again and len(said()) < 2:
            time.sleep(0.05)
        if len(said()) < 2:
            self.late(f"that the table may still be moving was said once in {SAID_AGAIN_S:g} s, "
                      f"after {fault.name}")

    # --- what must hold afterwards

    def under_way(self):
        """A fault came in CHECK, which waits for devices, and has ended nothing."""
        waited_for = [began for fault, began in self.begun if fault.waited_for and self.in_check(began)]
        return waited_for and not {"IDLE", "FAULT"} & {s for t, s, _ in self.states() if t > min(waited_for)}

    def in_check(self, moment):
        return [state for t, state, _ in self.states() if t <= moment][-1:] == ["CHECK"]

    def look_after(self):
        self.lift()
        if self.begun and not self.stand.left and self.under_way():
            self.stop_as_anyone()
        lifted = time.monotonic()
        self.result.reached = self.stand.reached
        self.at_rest_if_dead()
        self.stand.start_again()
        time.sleep(AFTERWARDS_S)
        if self.at_rest_if_dead():  # only now: without memory an orderly end takes a while
            self.stand.start_again()
        if not any(f.effect == STILL_MOVES for f in self.faults):
            moving = self.stand.observer.moving(lifted + ORDER)
            if moving and not self.result.violations:
                self.wrong(f"motion came back by itself: {moving[0].amplitude:.2f} m/s^2, "
                           f"{moving[0].t - lifted:.2f} s after {self.named()} was lifted")
        self.answers()
        self.at_rest_in_rest_states()
        self.one_alarm_a_cause()
        self.nothing_is_missing()

    def answers(self):
        if self.stand.daemon.process.poll() is not None:
            return self.wrong(f"the daemon has ended by itself with {self.stand.daemon.process.returncode}")
        try:
            with contextlib.closing(Client(self.stand.daemon.socket)) as client:
                if "result" not in client.ask("ping"):
                    self.wrong("the daemon does not answer a ping as it should")
        except (OSError, AssertionError) as trouble:
            self.late(f"the daemon does not answer: {str(trouble)[:200]}")

    def states(self):
        return sorted({pair for witness in self.stand.witnesses for pair in witness.states()})

    def at_rest_in_rest_states(self):
        """Never moving in IDLE, FAULT or CHECK, beyond the bounds of what was done."""
        if any(f.effect == STILL_MOVES for f in self.faults):
            return
        states = self.states()
        for (entered, state, _), (left, *_) in zip(states, [*states[1:], (float("inf"),)]):
            if state not in REST:
                continue
            free = max([entered + ORDER, *(began + f.bound_s for f, began in self.begun if began < left)])
            free += self.slack_s + self.stand.observer.lateness(entered, free)
            moving = self.stand.observer.moving(free, left)
            if moving and not self.result.violations:
                self.wrong(f"the table moves {moving[0].amplitude:.2f} m/s^2 in {state}, "
                           f"{moving[0].t - entered:.2f} s after that was entered")

    def errors(self, since):
        """Each error alarm once, but for what follows from another, and that the table may still move."""
        found = {}
        for witness in self.stand.witnesses:
            for alarm in witness.alarms(since):
                if MAY_MOVE in alarm["text"] or "cause" in alarm:
                    continue
                asked = alarm["code"] == "emergency_stop" and alarm["t_mono_ns"] * 1e-9 > self.asked
                if alarm["severity"] == "error" and not asked:
                    found.setdefault(alarm["t_mono_ns"], alarm)
        return list(found.values())

    def one_alarm_a_cause(self):
        if any(f.effect == REFUSED for f in self.faults):
            return
        errors = self.errors(self.begun[0][1])
        if len(errors) > len(self.faults):
            told = "; ".join(f"{a['code']}: {a['text'][:90]}" for a in errors)
            self.late(f"{len(errors)} error alarms for {len(self.faults)} cause(s): {told}")
        moved = self.stand.observer.moving(self.begun[0][1] - 0.3, self.begun[0][1])
        owed = [f for f in self.faults if f.effect == STOPS and not f.silent]
        if len(owed) == len(self.faults) and moved and not errors:
            self.late(f"no error alarm tells of {self.named()}")

    def nothing_is_missing(self):
        files = [f for f in self.stand.daemon.data.glob("*.db*") if f.is_file() and not f.is_symlink()
                 and not f.name.endswith(("-wal", "-shm"))]
        acknowledged = [pair for witness in self.stand.witnesses for pair in witness.acknowledged()]
        self.result.acknowledged = sum(line["type"] != "run_start" for line, _ in acknowledged)
        if self.stand.excused:
            return
        if self.stand.readable is not None:
            self.damaged_is_kept(missing(acknowledged, files))
            acknowledged = [pair for pair in acknowledged if pair[1] in self.stand.readable]
        lost = missing(acknowledged, files)
        if lost:
            self.wrong(f"{len(lost)} of {self.result.acknowledged} acknowledged are lost: {lost[0]}")

    def damaged_is_kept(self, lost):
        """What a damaged log held cannot all be read; it must be there still, and someone must say so."""
        if not lost or any(fault.name == "log_cut" for fault in self.faults):
            return
        kept = any(f.is_file() and f.stat().st_size == len(self.stand.damaged_log)
                   and f.read_bytes() == self.stand.damaged_log for f in self.stand.daemon.data.rglob("*"))
        if not kept:
            self.wrong(f"{len(lost)} acknowledged are lost, and the damaged log was not kept")
        if all(a["severity"] == "info" or "all whole" in a["text"] for a in self.stand.witness.alarms()):
            self.wrong(f"{len(lost)} acknowledged are lost after damage, and no alarm says so")

    # --- for whoever reads a violation

    def named(self):
        return " and ".join(fault.name for fault in self.faults)

    def tell(self):
        zero = self.begun[0][1] if self.begun else time.monotonic()
        story = [(t, f"fault {f.name}") for f, t in self.begun]
        story += [(t, f"state {state}: {reason[:160]}") for t, state, reason in self.states()]
        for witness in self.stand.witnesses:
            story += [(a["t_mono_ns"] * 1e-9, f"{a['severity']} {a['code']}: {a['text'][:160]}")
                      for a in witness.alarms()]
        moves = False
        for reading in self.stand.observer.readings:
            if reading.moves != moves:
                moves = reading.moves
                story.append((reading.t, f"table {'moves' if moves else 'rests'}"))
        self.result.story = [f"{t - zero:8.2f} s  {what}" for t, what in sorted(set(story))]
