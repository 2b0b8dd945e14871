"""Writes the logs that are made up: every kind of line that a candump log may hold, good and bad."""
import math
import pathlib
import random
import struct

HERE = pathlib.Path(__file__).resolve().parent
START = 1436509052.0


def line(t, identifier, body, interface="can0"):
    return f"({START + t:.6f}) {interface} {identifier}#{body}"


def position(metres, rest="FFFF00"):
    return struct.pack("<i", round(metres * 1e9)).hex().upper() + rest


def faults():
    draw = random.Random(6)
    lines = []
    for k in range(400):
        t = k * 1e-3
        u = 0.05 + 0.02 * math.sin(2 * math.pi * 2.5 * t)
        lines.append(line(t, "181", position(u, draw.choice(["FFFF", "FFFF00", "0100AA"]))))
        table = round(9810 * math.sin(2 * math.pi * 2.5 * t))
        page = k % 3
        lines.append(line(t + 3e-4, "120", struct.pack(">hhBB", table, 1000 - k, page, 0).hex()))
        if k % 10 == 0:
            force = struct.pack("<ff", 2500.0 - k, 0.5).hex()
            lines.append(line(t + 5e-4, "18FEF1FE", force))
    lines[50:50] = [line(0.0178, "181", "40E2"), line(0.0179, "120", ""), line(0.01791, "181", "R7"),
                    line(0.01792, "00000181", position(0.4)), line(0.01793, "7FF", "00" * 8)]
    lines[120:120] = [line(0.05, "20000004", "0010000000000000"), line(0.0501, "20000040", "00" * 8),
                      line(0.0502, "20000100", "00" * 8), line(0.0503, "20000004", "0001000000000000")]
    lines[200:200] = ["", "rubbish", line(0.09, "181", "40E2010"), line(0.09, "181", "40E201GG"), "(x.y) can0 181#00",
                      "(1436509052.09) can0", "\x00\xff\x80 binary", "#" * 40000, line(0.09, "9999", "00")]
    lines[300:300] = [line(0.135, "181", position(0.6)), line(0.1351, "18FEF1FE", "0000C07F00000000"),
                      line(-5.0, "181", position(0.05)), line(0.1353, "181", position(-0.5) + "", "can1")]
    return lines


def wide_fd():
    lines = []
    for k in range(120):
        t = k * 5e-3
        data = bytearray(64)
        data[60:64] = struct.pack(">i", round(1e6 * (0.05 + 0.02 * math.sin(2 * math.pi * t))))
        flags = k % 4
        length = 64 if k % 20 else 48  # every twentieth is cut
        lines.append(line(t, "12C", f"#{flags:X}{bytes(data[:length]).hex().upper()}"))
    return lines


def main():
    for name, lines in (("faults", faults()), ("wide_fd", wide_fd())):
        (HERE / f"{name}.log").write_bytes("".join(f"{text}\n" for text in lines).encode("latin-1"))


if __name__ == "__main__":
    main()
