"""Writes registers.csv: what each type and word order looks like on the wire.

Made by Python's struct module, which knows nothing of this project. Columns: type, order, value,
word0, word1 (hexadecimal; word1 is empty for 16-bit types).
  /usr/bin/python3 make_registers.py > registers.csv
  /usr/bin/python3 make_registers.py --check   (the file is what this script writes)
"""
import pathlib
import struct
import sys

FORMATS = {"u16": ">H", "i16": ">h", "u32": ">I", "i32": ">i", "f32": ">f"}
VALUES = {
    "u16": [0, 1, 255, 256, 4660, 32767, 32768, 65535],
    "i16": [0, 1, -1, 255, -256, 4660, 32767, -32768],
    "u32": [0, 1, 65535, 65536, 305419896, 2147483648, 4294967295],
    "i32": [0, 1, -1, -2, 65536, 305419896, -305419896, 2147483647, -2147483648],
    "f32": [0.0, 1.0, -1.0, 0.5, 3.1415927410125732, -118.625, 1e-30, 3.4028234663852886e38,
            1.401298464324817e-45, 16777217.0],
}
ORDERS = {"abcd": (0, 1, 2, 3), "cdab": (2, 3, 0, 1), "badc": (1, 0, 3, 2), "dcba": (3, 2, 1, 0)}


def rows():
    yield "type,order,value,word0,word1"
    for kind, values in VALUES.items():
        for order, places in ORDERS.items():
            for value in values:
                wire = struct.pack(FORMATS[kind], value)
                if len(wire) == 4:
                    wire = bytes(wire[i] for i in places)
                words = [wire[i:i + 2].hex().upper() for i in range(0, len(wire), 2)]
                value = struct.unpack(FORMATS[kind], struct.pack(FORMATS[kind], value))[0]
                yield ",".join([kind, order, repr(value), *words, ""][:5])


def main():
    text = "\n".join(rows()) + "\n"
    if sys.argv[1:] != ["--check"]:
        sys.stdout.write(text)
        return 0
    file = pathlib.Path(__file__).with_name("registers.csv")
    if file.read_text() != text:
        print(f"{file.name} is not what this script writes")
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
