"""Writes seeds/frames.bin: some frames as fuzz_frame.cpp takes them."""
import pathlib
import struct

FD, EXTENDED, REMOTE, ERROR = 1, 2, 4, 8
FRAMES = [(0, 0x701, b"\x00"), (0, 0x701, b"\x05"), (0, 0x181, b"\x40\xE2\x01\x00\xFF\xFF"),
          (0, 0x181, b"\x40\xE2\x01\x00\xFF\xFF\x00"), (0, 0x120, bytes(6)), (0, 0x120, b"\x01\x02\x03\x04\x01\x00"),
          (EXTENDED, 0x18FEF1FE, bytes(8)), (FD, 300, bytes(64)), (REMOTE, 0x181, bytes(8)),
          (ERROR, 0x040, bytes(8)), (ERROR, 0x100, bytes(8)), (ERROR, 0x004, b"\x00\x31" + bytes(6)),
          (0, 0x081, b"\x30\x42\x11" + bytes(5)), (0, 0x081, bytes(8)), (0, 0x701, b"\x7F"), (0, 0x701, b"\x00"),
          (0, 0x201, b"\x03\x00\x05\x00\xC4\x09\x52\x26")]

if __name__ == "__main__":
    text = b"".join(struct.pack("<BBI", flags, len(data), number) + data for flags, number, data in FRAMES)
    (pathlib.Path(__file__).resolve().parent / "seeds" / "frames.bin").write_bytes(text)
