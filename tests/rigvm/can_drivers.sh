#!/bin/bash
# The CAN drivers against a real SocketCAN interface: stamps, filters, overflow, links that come and go,
# CAN FD, error frames, CANopen, and setpoint frames that stop by themselves.
set -e
cd "$(dirname "$0")"
./can_wire_test
