"""Plays a CANopen transducer and an accelerometer on vcan0 with python3-can, for tests/rigvm/can_record.sh."""
import math
import struct
import time

import can


def main():
    bus = can.Bus(interface="socketcan", channel="vcan0")

    def send(identifier, data, extended=False):
        bus.send(can.Message(arbitration_id=identifier, data=data, is_extended_id=extended))

    send(0x701, [0])  # boot-up
    send(0x701, [5])  # operational
    begin = time.monotonic()
    for k in range(400):
        t = k * 0.005
        while time.monotonic() < begin + t:
            time.sleep(0.001)
        phase = 2 * math.pi * 1.5 * t
        metres = 0.08 + 0.03 * math.sin(phase - 0.4)
        rate = 0.03 * 2 * math.pi * 1.5 * math.cos(phase - 0.4)
        tpdo = struct.pack("<ih", round(metres * 1e9), round(rate * 1e5))
        send(0x181, tpdo + bytes([0x80])[: k % 2])
        send(0x120, struct.pack(">hhBB", round(9810 * math.sin(phase)), -round(3000 * math.sin(phase)), k % 2, 0))
    bus.shutdown()


if __name__ == "__main__":
    main()
