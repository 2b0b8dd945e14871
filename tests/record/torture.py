#!/usr/bin/env python3
"""Runs the record's torture tests for long: damages, power cuts, failing calls and allocations.

Exit status 0: everything that was acknowledged was read or counted as lost, and nothing crashed.
"""
import argparse
import os
import subprocess
import sys

TESTS = {"damage": "Undamaged.*:DamagedLog.*:DamagedFile.*", "power": "PowerCut.*", "disk": "FailingDisk.*",
         "memory": "Memory.*"}

if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", help="test_record_torture in the build folder")
    parser.add_argument("--count", type=int, default=2000, help="power cuts, and flipped bits of a file's pages")
    parser.add_argument("--seed", type=int, default=20260301)
    parser.add_argument("--only", choices=sorted(TESTS), action="append", help="one part; may be repeated")
    options = parser.parse_args()
    names = ":".join(TESTS[part] for part in options.only or TESTS)
    environment = dict(os.environ, RECORD_TORTURE_COUNT=str(options.count), RECORD_TORTURE_SEED=str(options.seed))
    sys.exit(subprocess.run([options.program, "--gtest_brief=1", f"--gtest_filter={names}"], env=environment).returncode)
