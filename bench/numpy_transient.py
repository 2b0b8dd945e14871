#!/usr/bin/python3
"""Jobs J8a and J8b in NumPy: the oleo in time, a swept sine and a free decay, at 1 kHz.

    bench/numpy_transient.py make FOLDER     writes J8a.csv, J8b.csv and their *_reference.txt
    bench/numpy_transient.py fit FOLDER [--jobs J8a,J8b] [--times 7] [--json]

`make` integrates (DOP853, tolerance 1e-12), adds noise of 2e-5 m with a stated seed, and finds the
optimum with that integrator: four parameters, then the first stroke and velocity. `fit` prints the
median and the least CPU time of a fit from 5 % above the truth, its error against that optimum (of
the parameters), and its iterations.

Method: multiple shooting. All segments are integrated abreast, one NumPy operation for all, by
Runge-Kutta of fourth order, one step a sample, with their sensitivities. Each Gauss-Newton step
changes theta and the first state and closes the gaps between the segments.
"""
import argparse
import json
import math
import pathlib
import time

import numpy
from scipy.integrate import solve_ivp
from scipy.linalg.lapack import dgbsv

GRAVITY = 9.80665
TRUTH = numpy.array([13.3, 1.8, 4.3, 1.2])
NOISE = 2e-5
SEED = 8
STEP = 1e-3


def swept_sine(t):
    phase = 2.0 * math.pi * (0.5 * t + 7.5 * t * t / 200.0)
    return 3.0 * (numpy.sin(phase) if numpy.ndim(t) else math.sin(phase))


def none(t):
    return 0.0 * t


# Name: samples, first state, excitation, samples in a segment.
JOBS = {"J8a": (100_000, (0.15, 0.0), swept_sine, 50),
        "J8b": (20_000, (0.05, 0.0), none, 25)}


class Trajectories:
    """Many trajectories abreast. y[0] and y[1]: stroke and velocity; rows of each: the value, its
    derivatives over the four parameters and over the first state."""

    def __init__(self, lanes):
        self.lanes = lanes
        self.slopes = [numpy.empty((2, 7, lanes)) for _ in range(4)]
        self.at = numpy.empty((2, 7, lanes))
        self.work = numpy.empty((7, lanes))

    def first(self, state):
        y = numpy.zeros((2, 7, self.lanes))
        y[:, 0] = state
        y[0, 5] = y[1, 6] = 1.0
        return y

    def slope(self, y, theta, x, out):
        u, v = y[0, 0], y[1, 0]
        q = 1.0 - theta[2] * u
        log = numpy.log(q)
        gas = theta[1] * numpy.exp(-theta[3] * log)
        over_q = theta[3] * gas / q
        size = numpy.abs(v)
        drag = size * v
        out[0] = y[1]
        numpy.multiply(y[0], -theta[2] * over_q, out=out[1])
        numpy.multiply(y[1], -2.0 * theta[0] * size, out=self.work)
        out[1] += self.work
        out[1, 0] = x - theta[0] * drag - gas
        out[1, 1] -= drag
        out[1, 2] -= gas / theta[1]
        out[1, 3] -= u * over_q
        out[1, 4] += log * gas

    def step(self, y, theta, x, h):
        """Changes y. x: excitation with gravity at the beginning, middle and end."""
        k1, k2, k3, k4 = self.slopes
        at = self.at
        self.slope(y, theta, x[0], k1)
        for before, after, part, value in ((k1, k2, 0.5, x[1]), (k2, k3, 0.5, x[1]),
                                           (k3, k4, 1.0, x[2])):
            numpy.multiply(before, part * h, out=at)
            at += y
            self.slope(at, theta, value, after)
        k2 += k3
        k2 *= 2.0
        k1 += k2
        k1 += k4
        k1 *= h / 6.0
        y += k1


class Record:
    """A record at equal steps, cut into segments of `length` samples."""

    def __init__(self, displacement, excitation, length):
        self.length, self.segments = length, len(displacement) // length
        self.samples = displacement[:self.length * self.segments].reshape(self.segments, length)
        x = numpy.append(excitation, excitation[-1]) + GRAVITY
        around = numpy.pad(x, 1, mode="edge")
        middle = (9.0 * (around[1:-2] + around[2:-1]) - around[:-3] - around[3:]) / 16.0
        of_steps = numpy.stack([x[:-1], middle, x[1:]])[:, :self.samples.size]
        self.excitation = numpy.ascontiguousarray(  # sample, part of its step, segment
            of_steps.reshape(3, self.segments, length).transpose(2, 0, 1))
        self.first = self.states_from(displacement)
        self.trajectories = Trajectories(self.segments)
        self.kept = numpy.empty((length, 7, self.segments))

    def states_from(self, displacement, half=20):
        """Stroke and velocity at the segments' starts: a cubic through the samples around."""
        at = numpy.arange(self.segments) * self.length
        begin = numpy.clip(at - half, 0, len(displacement) - 2 * half - 1)
        window = displacement[begin[:, None] + numpy.arange(2 * half + 1)]
        powers = numpy.arange(4)
        cubic = numpy.linalg.pinv((numpy.arange(-half, half + 1) / half)[:, None]**powers)
        coefficients = window @ cubic.T
        place = ((at - begin - half) / half)[:, None]
        value = (coefficients * place**powers).sum(1)
        rate = (coefficients[:, 1:] * powers[1:] * place**powers[:3]).sum(1) / (half * STEP)
        return numpy.stack([value, rate])

    def fit(self, start, tolerance=1e-8):
        theta, states = numpy.array(start), self.first
        before = None
        for self.iterations in range(1, 41):
            y = self.integrated(theta, states)
            products = self.products()
            condensed = self.condensed(y, states)
            # Of (-residual, theta, first state): the rows of all samples, squared.
            total = (condensed.transpose(0, 2, 1) @ products @ condensed).sum(0)
            scale = numpy.concatenate([theta, [0.1, 1.0]])
            normal = total[1:, 1:] * scale * scale[:, None]
            change = -numpy.linalg.solve(normal, total[1:, 0] * scale)
            moved = numpy.concatenate([[1.0], change * scale])
            states = states + (condensed[:, 5:] @ moved).T
            theta = theta * (1.0 + change[:4])
            step = numpy.abs(change[:4]).max()
            rate = step / before if before else 1.0
            if step < tolerance or (rate < 0.5 and step * rate < tolerance):
                return numpy.concatenate([theta, states[:, 0]])
            before = step
        raise ArithmeticError("did not converge")

    def integrated(self, theta, states):
        """The segments' ends; `kept` has what belongs to the samples."""
        y = self.trajectories.first(states)
        for i, x in enumerate(self.excitation):
            self.kept[i] = y[0]
            self.trajectories.step(y, theta, x, STEP)
        return y

    def derivatives(self, optimum):
        """Of the strokes of a record of one segment, over theta and the first state."""
        self.integrated(optimum[:4], optimum[4:, None])
        return self.kept[:, 1:, 0]

    def products(self):
        """Of each segment: products of (-residual, derivatives over theta and its own state)."""
        self.kept[:, 0] -= self.samples.T
        rows = numpy.ascontiguousarray(self.kept.transpose(2, 1, 0))
        return rows @ rows.transpose(0, 2, 1)

    def condensed(self, ends, states):
        """Of each segment: (1, theta, its own state's change) over (1, theta, first state's)."""
        n = self.segments
        # The change of state k + 1 is the gap before it, then what theta and state k cause.
        band = numpy.zeros((2 * n, 7))  # LAPACK's, 3 below and none above, 3 for exchanges
        band[:, 3] = 1.0
        for r in (0, 1):
            for c in (0, 1):
                band[c:2 * n - 2:2, 3 + 2 + r - c] = -ends[r, 5 + c, :-1]
        right = numpy.zeros((7, n, 2))
        right[5, 0, 0] = right[6, 0, 1] = 1.0
        right[0, 1:] = (ends[:, 0, :-1] - states[:, 1:]).T
        right[1:5, 1:] = ends[:, 1:5, :-1].transpose(1, 2, 0)
        _, _, solved, _ = dgbsv(3, 0, band.T, right.reshape(7, -1).T, overwrite_ab=True,
                                overwrite_b=True)
        condensed = numpy.zeros((n, 7, 7))
        condensed[:, range(5), range(5)] = 1.0
        condensed[:, 5:] = solved.reshape(n, 2, 7)
        return condensed


def strokes(job, theta, first):
    """At the samples, by DOP853 to 1e-12."""
    samples, _, excitation, _ = JOBS[job]
    orifice, load, shape, index = map(float, theta)

    def slope(t, y):
        u, v = y
        return (v, excitation(t) + GRAVITY - orifice * abs(v) * v -
                load * (1.0 - shape * u) ** -index)

    t = STEP * numpy.arange(samples)
    return solve_ivp(slope, (0.0, t[-1]), first, "DOP853", t, rtol=1e-12, atol=1e-14).y[0]


def make(folder):
    folder.mkdir(parents=True, exist_ok=True)
    for number, (job, (samples, first, excitation, length)) in enumerate(JOBS.items()):
        t = STEP * numpy.arange(samples)
        noise = NOISE * numpy.random.default_rng([SEED, number]).standard_normal(samples)
        u = strokes(job, TRUTH, first) + noise
        driven = excitation is not none
        columns = [t, excitation(t), u] if driven else [t, u]
        names = ["t", "excitation", "displacement"] if driven else ["t", "displacement"]
        numpy.savetxt(folder / f"{job}.csv", numpy.stack(columns, 1), "%.17g", ",",
                      header=",".join(names), comments="")
        optimum = Record(u, excitation(t), length).fit(TRUTH)
        # One more step, with the residuals of the accurate integrator.
        rows = Record(u, excitation(t), samples).derivatives(optimum)
        residual = u - strokes(job, optimum[:4], optimum[4:])
        change = numpy.linalg.lstsq(rows, residual, rcond=None)[0]
        optimum += change
        print(f"{job}: {samples} samples, seed {[SEED, number]}; the accurate integrator moves the "
              f"optimum by {numpy.abs(change[:4] / optimum[:4]).max():.1e}")
        numpy.savetxt(folder / f"{job}_reference.txt", optimum, "%.17g")


def fit(given):
    for job in given.jobs.split(","):
        table = numpy.loadtxt(given.folder / f"{job}.csv", delimiter=",", skiprows=1)
        reference = numpy.loadtxt(given.folder / f"{job}_reference.txt")
        excitation = table[:, 1] if table.shape[1] == 3 else numpy.zeros(len(table))
        record = Record(table[:, -1], excitation, given.segment or JOBS[job][3])
        taken = []
        for _ in range(given.times):
            began = time.process_time()
            found = record.fit(1.05 * TRUTH)
            taken.append(1e3 * (time.process_time() - began))
        error = numpy.abs(found / reference - 1.0)[:4].max()
        result = {"job": job, "median_ms": float(numpy.median(taken)), "least_ms": min(taken),
                  "error": float(error), "iterations": [record.iterations]}
        print(json.dumps(result) if given.json else
              f"{job:8} {result['median_ms']:9.3f} ms (least {result['least_ms']:.3f}), "
              f"error {error:.1e}, iterations {record.iterations}")


def main():
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("what", choices=["make", "fit"])
    options.add_argument("folder", type=pathlib.Path)
    options.add_argument("--jobs", default="J8a,J8b")
    options.add_argument("--segment", type=int, default=0, help="samples; 0: as set for each job")
    options.add_argument("--times", type=int, default=7)
    options.add_argument("--json", action="store_true", help="one object a line")
    given = options.parse_args()
    if given.what == "make":
        make(given.folder)
    else:
        fit(given)


if __name__ == "__main__":
    main()
