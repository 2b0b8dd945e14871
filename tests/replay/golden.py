"""Writes the sample streams that the logs must give, with code of its own.

    /usr/bin/python3 golden.py          writes NAME.golden for each NAME.log
    /usr/bin/python3 golden.py --check  fails when one is not what would be written
"""
import math
import pathlib
import re
import sys

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "data" / "can"))
from reference import decode, read_raw, bit_positions  # noqa: E402

# channel, identifier, extended, (start, bits, order, format, factor), selector (start, bits, order, value),
# range, scale, offset: what tests/data/can/rig.dbc and the test's rig say, by hand.
SIGNALS = [
    ("displacement", 0x181, False, (0, 32, "i", "s", 1e-9), None, (-0.5, 0.5), 1.0, 0.0),
    ("displacement", 0x12C, False, (487, 32, "m", "s", 1e-6), None, None, 1.0, 0.0),
    ("excitation", 0x120, False, (7, 16, "m", "s", 1e-3), None, None, 1.0, 0.0),
    ("acceleration", 0x120, False, (23, 16, "m", "s", 1e-3), (39, 8, "m", 0), None, -1.0, 0.5),
    ("force", 0x18FEF1FE, True, (0, 32, "i", "f", 1.0), None, None, 1.0, 0.0),
]
LINE = re.compile(rb"\((\d+)\.(\d{1,9})\) (\S+) ([0-9A-F]{3}|[0-9A-F]{8})#(\S*)( [RT])?\Z")
CLASSIC = re.compile(rb"((?:[0-9A-Fa-f]{2}){0,8})\Z")
FD = re.compile(rb"#[0-9A-F]((?:[0-9A-Fa-f]{2}){0,64})\Z")
BUFFER = 16384  # a longer line counts once for each piece of this size


class Replay:
    def __init__(self):
        self.rows, self.malformed, self.errors, self.lost = [], 0, 0, 0
        self.first = self.newest = None

    def line(self, text):
        if not text.strip(b" \t\r"):
            return
        match = LINE.match(text.rstrip(b"\r "))
        if not match:
            self.malformed += 1
            return
        whole, fraction, _, identifier, body, _ = match.groups()
        t = int(whole) * 10**9 + int(fraction.ljust(9, b"0"))
        number, long = int(identifier, 16), len(identifier) == 8
        if (not long and number > 0x7FF) or number >= 0x40000000:
            self.malformed += 1
            return
        if re.match(rb"R[0-8]?\Z", body):
            return
        data = CLASSIC.match(body) or FD.match(body)
        if not data:
            self.malformed += 1
            return
        self.frame(t, number, long, bytes.fromhex(data.group(1).decode()))

    def frame(self, t, number, long, data):
        if long and number & 0x20000000:
            self.errors += 1
            if number & 4 and len(data) > 1 and data[1] & 1:
                self.lost += 1
            return
        short = False
        for channel, identifier, extended, bits, selector, allowed, scale, offset in SIGNALS:
            if identifier != number or extended != long:
                continue
            if selector:
                chosen = read_raw(data, bit_positions(*selector[:3]))
                if chosen is None:
                    short = True
                    continue
                if chosen != selector[3]:
                    continue
            start, length, order, form, factor = bits
            value = decode(data, start, length, order, form, factor)
            if value is None:
                short = True
                continue
            bad = not math.isfinite(value) or (allowed and not allowed[0] - factor / 2 <= value <= allowed[1] + factor / 2)
            self.sample(t, channel, value * scale + offset, "bad" if bad else "good")
        self.malformed += short

    def sample(self, t, channel, value, quality):
        self.first = t if self.first is None else self.first
        self.newest = t if self.newest is None else max(self.newest, t)
        self.rows.append(f"{self.newest - self.first} {channel} {value!r} {quality}")


def golden(log):
    replay = Replay()
    for text in log.read_bytes().split(b"\n"):
        for at in range(0, max(len(text), 1), BUFFER):
            replay.line(text[at:at + BUFFER])
    counters = f"samples {len(replay.rows)} malformed {replay.malformed} errors {replay.errors} lost {replay.lost}"
    return "\n".join(replay.rows + [counters]) + "\n"


def main():
    logs = sorted(HERE.glob("*.log"))
    assert logs
    for log in logs:
        file, text = log.with_suffix(".golden"), golden(log)
        if "--check" not in sys.argv:
            file.write_text(text)
        elif file.read_text() != text:
            sys.exit(f"{file} is not what this script writes; run it without --check and look at the difference")


if __name__ == "__main__":
    main()
