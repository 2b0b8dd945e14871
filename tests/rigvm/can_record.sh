#!/bin/bash
# Records tests/replay/transducer.log anew; not a test. player.py is tests/replay/player.py.
set -e
cd /srv/rigvm/out
candump -L -n 802 -T 20000 vcan0 >transducer.log &
dump=$!
for _ in $(seq 50); do grep -q '^ *vcan0 ' /proc/net/can/rcvlist_all && break; sleep 0.1; done
/usr/bin/python3 /srv/rigvm/player.py
wait $dump
wc -l transducer.log
