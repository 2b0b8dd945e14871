#!/bin/bash
# A frame that cansend puts on the bus is the frame that candump sees.
set -e
candump -L -n 3 -T 5000 vcan0 >/run/dump &
dump=$!
for _ in $(seq 50); do grep -q '^ *vcan0 ' /proc/net/can/rcvlist_all && break; sleep 0.1; done
cansend vcan0 123#DEADBEEF
cansend vcan0 12345678#0102030405060708
cansend vcan0 321##5AABBCC
wait $dump
cat /run/dump
cut -d ' ' -f 3 /run/dump | diff - <(printf '%s\n' 123#DEADBEEF 12345678#0102030405060708 321##5AABBCC)
echo "three frames out, the same three in, on $(uname -r) under $(ps -o comm= 1)"
