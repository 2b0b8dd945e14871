#!/usr/bin/python3
"""This program and NumPy on the same jobs, in turn, on one core.

    bench/against_numpy.py REFERENCE_FOLDER J8_FOLDER [--build build] [--core 0] [--rounds 5]
        [--jobs J6,J7,J7_640,J8a,J8b]

Needs `ninja -C build bench_jobs`, and J8_FOLDER from `bench/numpy_transient.py make`. In each round
each job runs here, then in NumPy. Prints the least and the median CPU time of a fit over all
rounds, the ratio of the least ones, and the largest relative error of a parameter. The first line
is J1, by which machines can be compared. BLAS runs in one thread and chooses its own kernels. A
second table has the fits from the corners of the box 20 % around the truth: how many took the
nested method, and how many missed the optimum.
"""
import argparse
import json
import os
import pathlib
import statistics
import subprocess

HERE = pathlib.Path(__file__).resolve().parent
# Fits a round, here and in NumPy.
FITS = {"J1": (2001, 0), "J6": (31, 31), "J7": (11, 15), "J7_640": (15, 25), "J8a": (3, 3),
        "J8b": (3, 5)}


def results(command):
    environment = {key: value for key, value in os.environ.items()
                   if key not in ("OPENBLAS_CORETYPE", "OPENBLAS_L2_SIZE")}
    environment.update(OPENBLAS_NUM_THREADS="1", OMP_NUM_THREADS="1")
    return json.loads(subprocess.run(command, env=environment, check=True, text=True,
                                     stdout=subprocess.PIPE).stdout)


def measured(given, job, here):
    folder = given.j8 if job.startswith("J8") else given.reference
    times = str(FITS[job][0 if here else 1])
    pinned = ["taskset", "-c", str(given.core)]
    if here:
        return results(pinned + [given.build / "bench/bench_jobs", job, folder, times])
    program = ([HERE / "numpy_transient.py", "fit"] if job.startswith("J8")
               else [HERE / "numpy_periodic.py"])
    return results(pinned + ["/usr/bin/python3", *program, folder, "--jobs", job, "--times", times,
                             "--json"])


def summary(rounds):
    return (min(one["least_ms"] for one in rounds),
            statistics.median(one["median_ms"] for one in rounds),
            max(one["error"] for one in rounds))


def row(job, here, theirs):
    least, median, error = summary(here)
    cells = [job, f"{least:.3g} ({median:.3g})", "", "", f"{error:.1e}", ""]
    if theirs:
        their_least, their_median, their_error = summary(theirs)
        cells[2] = f"{their_least:.3g} ({their_median:.3g})"
        cells[3] = f"{their_least / least:.3g}"
        cells[5] = f"{their_error:.1e}"
    if not all(one["converged"] for one in here):
        cells[4] += ", not converged"
    return cells


def main():
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("reference", type=pathlib.Path)
    options.add_argument("j8", type=pathlib.Path)
    options.add_argument("--build", type=pathlib.Path, default=HERE.parent / "build")
    options.add_argument("--core", type=int, default=0)
    options.add_argument("--rounds", type=int, default=5)
    options.add_argument("--jobs", default="J6,J7,J7_640,J8a,J8b")
    given = options.parse_args()
    jobs = ["J1", *given.jobs.split(",")]
    here, theirs = {job: [] for job in jobs}, {job: [] for job in jobs}
    for _ in range(given.rounds):
        for job in jobs:
            here[job].append(measured(given, job, True))
            if FITS[job][1]:
                theirs[job].append(measured(given, job, False))
    print("| job | here, ms (median) | NumPy, ms (median) | ratio | error here | error of NumPy |")
    print("|---|---|---|---|---|---|")
    for job in jobs:
        print("| " + " | ".join(row(job, here[job], theirs[job])) + " |")
    print("\n| job | fits from 20 % off | nested | missed | longest, ms |\n|---|---|---|---|---|")
    for job in jobs:
        corners = [one["corners"] for one in here[job] if "corners" in one]
        if corners:
            longest = min(one["longest_ms"] for one in corners)
            cells = [job, *(str(corners[0][key]) for key in ("fits", "nested", "missed")),
                     f"{longest:.3g}"]
            print("| " + " | ".join(cells) + " |")


if __name__ == "__main__":
    main()
