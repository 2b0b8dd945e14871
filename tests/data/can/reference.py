"""An independent reader of CAN signals, one bit at a time, and the tables that the tests check against.

    /usr/bin/python3 reference.py          writes signals.csv beside this file
    /usr/bin/python3 reference.py --check  fails when signals.csv is not what would be written

Nothing is shared with protocol/can: bits are walked one by one in the numbering of the DBC format, values
are built with Python's integers and struct.
"""
import pathlib
import random
import struct
import sys

HERE = pathlib.Path(__file__).resolve().parent
HEADER = "start,length,order,format,factor,offset,data,decoded,value,encoded"
FD_LENGTHS = [1, 2, 3, 4, 5, 6, 7, 8, 12, 16, 20, 24, 32, 48, 64]


def bit_positions(start, length, order):
    """Numbers of the signal's bits, least significant first; None where there is no such bit."""
    if order == "i":
        return list(range(start, start + length))
    walked, bit = [], start
    for _ in range(length):
        walked.append(bit)
        bit = bit + 15 if bit % 8 == 0 else bit - 1  # to bit 7 of the next byte, or one down
    return walked[::-1]


def read_raw(data, positions):
    """The signal's bits as a whole number, or None when the frame ends before."""
    raw = 0
    for weight, bit in enumerate(positions):
        if bit // 8 >= len(data):
            return None
        raw += ((data[bit // 8] >> (bit % 8)) & 1) * 2**weight
    return raw


def write_raw(data, positions, raw):
    data = bytearray(data)
    for weight, bit in enumerate(positions):
        data[bit // 8] &= 0xFF ^ (1 << (bit % 8))
        data[bit // 8] |= ((raw >> weight) & 1) << (bit % 8)
    return bytes(data)


def number(raw, length, form):
    if form == "f":
        return struct.unpack("<f", struct.pack("<I", raw))[0]
    if form == "d":
        return struct.unpack("<d", struct.pack("<Q", raw))[0]
    if form == "s" and raw >= 2 ** (length - 1):
        return raw - 2**length
    return raw


def bits_of(value, length, form):
    if form == "f":
        return struct.unpack("<I", struct.pack("<f", value))[0]
    if form == "d":
        return struct.unpack("<Q", struct.pack("<d", value))[0]
    return value % 2**length


def decode(data, start, length, order, form, factor=1.0, offset=0.0):
    raw = read_raw(data, bit_positions(start, length, order))
    return None if raw is None else number(raw, length, form) * factor + offset


def random_row(draw):
    form = draw.choice("uuussssfd")
    length = {"f": 32, "d": 64}.get(form) or draw.randint(1, 64)
    order = draw.choice("im")
    size = draw.choice([n for n in FD_LENGTHS if n * 8 >= length])
    fitting = [s for s in range(size * 8)
               if max(bit_positions(s, length, order)) < size * 8]
    start = draw.choice(fitting)
    positions = bit_positions(start, length, order)
    factor, offset = (1.0, 0.0) if form in "fd" else (draw.choice([1.0, 0.5, 0.125, 1e-3, -0.25, 2.5]),
                                                      draw.choice([0.0, 0.0, -40.0, 1000.5]))
    data = draw.randbytes(size)
    if form in "fd":  # random bits are seldom ordinary numbers
        data = write_raw(data, positions, bits_of(draw.uniform(-1e3, 1e3), length, form))
    decoded = decode(data, start, length, order, form, factor, offset)
    value = encoded = ""
    if length <= 48 or form == "d":
        low, high = (-2 ** (length - 1), 2 ** (length - 1) - 1) if form == "s" else (0, 2**length - 1)
        whole = draw.choice([low, high, draw.randint(low, high)])
        new = draw.uniform(-1e6, 1e6) if form in "fd" else whole
        value = repr(new * factor + offset)
        encoded = write_raw(data, positions, bits_of(new, length, form)).hex()
    if draw.random() < 0.15:  # the same signal in a frame that was cut short
        data = data[:draw.randint(0, max(positions) // 8)]
        decoded, value, encoded = None, "", ""
    shown = "short" if decoded is None else repr(float(decoded))
    return f"{start},{length},{order},{form},{factor},{offset},{data.hex()},{shown},{value},{encoded}"


def table():
    draw = random.Random(1991)
    return "\n".join([HEADER] + [random_row(draw) for _ in range(600)]) + "\n"


def main():
    file, text = HERE / "signals.csv", table()
    if "--check" in sys.argv:
        if file.read_text() != text:
            sys.exit(f"{file} is not what this script writes; run it without --check")
        return
    file.write_text(text)


if __name__ == "__main__":
    main()
