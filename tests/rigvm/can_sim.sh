#!/bin/bash
# oleosim's frames on a real SocketCAN interface, seen and driven by python-can.
set -e
cd "$(dirname "$0")"
/usr/bin/python3 ./can_face_check.py ./oleosim
