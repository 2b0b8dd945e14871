"""Writes oleo.can.log: the samples of oleo.registers.log as the frames of oleosim.dbc, packed here by hand."""
import pathlib
import re
import struct

HERE = pathlib.Path(__file__).resolve().parent
LINE = re.compile(r"\((\d+)\.(\d{9}) (\d+)\.(\d{9})\) input6#([0-9A-F]{24})")
START = 1_436_509_052_000_000  # a date, us


def main():
    out, before, counter = [], None, 0
    for text in (HERE / "oleo.registers.log").read_text().splitlines():
        match = LINE.match(text)
        if not match:
            continue
        stroke, table, stamp = struct.unpack(">ffI", bytes.fromhex(match.group(5)))
        if stamp == before:
            continue
        # Stamped by the rig's own clock: what a kernel's stamp would be on an idle machine.
        first = stamp if before is None else first
        before = stamp
        counter = (counter + 1) % 65536
        t = START + stamp - first
        frames = [(0x181, struct.pack("<fHB", stroke, counter, 0)),
                  (0x182, struct.pack(">iH", round(table / 1e-5), counter))]
        for identifier, data in frames:
            out.append(f"({t // 1000000}.{t % 1000000:06d}) can0 {identifier:03X}#{data.hex().upper()}")
    (HERE / "oleo.can.log").write_text("".join(line + "\n" for line in out))
    print(len(out), "frames")


if __name__ == "__main__":
    main()
