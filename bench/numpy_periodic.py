#!/usr/bin/python3
"""Jobs J6 and J7 in NumPy and SciPy: what a user of these would write to be fast.

    bench/numpy_periodic.py REFERENCE_FOLDER [--jobs J6,J7,J7_640] [--times 21] [--json]

REFERENCE_FOLDER holds oleo_j6.txt, oleo_j7.txt and their *_reference.txt. Prints for each job the
median and the least time of a fit, its error against the reference, and its iterations.

Method: theta and the periodic solutions move together (Gauss-Newton), one linearisation of the
model a step. Derivatives in time are central differences on the ring. The ring is folded (points
0, n-1, 1, n-2, ...), so that its matrix is banded, without corners, and LAPACK factorises it. The
measured coordinate starts from the data's harmonics, the other one from its own equation along
that motion. The first steps use a grid of fewer points, `--coarse none` leaves that out.
"""
import argparse
import json
import pathlib
import time

import numpy
from scipy.linalg.lapack import dgbsv

GRAVITY = 9.80665

# Half the width of the stencil: weights of the first and second derivative at unit spacing.
FIRST = {2: numpy.array([1, -8, 0, 8, -1]) / 12.0,
         3: numpy.array([-1, 9, -45, 0, 45, -9, 1]) / 60.0}
SECOND = {2: numpy.array([-1, 16, -30, 16, -1]) / 12.0,
          3: numpy.array([2, -27, 270, -490, 270, -27, 2]) / 180.0}


class Ring:
    """One period on n equal steps with two unknowns a point. All arrays are in folded order."""

    def __init__(self, n, period, width):
        self.n, self.step = n, period / n
        self.first, self.second = FIRST[width] / self.step, SECOND[width] / self.step**2
        self.point = numpy.empty(n, int)  # the point at each place of the folded ring
        self.point[0::2] = numpy.arange((n + 1) // 2)
        self.point[1::2] = numpy.arange(n - 1, (n + 1) // 2 - 1, -1)
        self.place = numpy.argsort(self.point)
        around = (self.point[:, None] + numpy.arange(-width, width + 1)) % n
        self.around = self.place[around]  # places of the neighbours of each place
        self.time = self.point * self.step
        self.weights = numpy.stack([self.first, self.second])
        # Address of the derivative of row `r` of a point over unknown `c` of a neighbour in
        # LAPACK's band.
        self.band = 4 * width + 1
        rows = 3 * self.band + 1
        row = 2 * numpy.arange(n)[:, None]
        self.address = {(r, c): 2 * self.band + (row + r) + (2 * self.around + c) * (rows - 1)
                        for r in (0, 1) for c in (0, 1)}
        self.matrix = numpy.zeros((2 * n, rows))

    def derivatives(self, u):
        return self.weights @ u[self.around].T

    def solve(self, blocks, right):
        """A z = right for each row of `right`. blocks[r, c]: derivatives over the neighbours."""
        self.matrix[:] = 0.0
        flat = self.matrix.reshape(-1)
        for key, values in blocks.items():
            flat[self.address[key]] = values
        _, _, z, info = dgbsv(self.band, self.band, self.matrix.T, right.T, overwrite_ab=True,
                              overwrite_b=True)
        if info:
            raise ArithmeticError("singular")
        return z.T


def oleo(theta, u, v):
    """Force of the orifice and the gas, over u, v and the four parameters."""
    q = 1.0 - theta[2] * u
    if q.min() <= 0.0:
        raise ArithmeticError("the gas is crushed")
    size = numpy.abs(v)
    log = numpy.log(q)
    power = numpy.exp(-theta[3] * log)
    gas = theta[1] * power
    over_q = theta[3] * gas / q
    return (theta[0] * size * v + gas, theta[2] * over_q, 2.0 * theta[0] * size,
            (size * v, power, u * over_q, -log * gas))


class OnTyre:
    """u'' + d'' + F(u, u') - g = x;  0.15 d'' - F + k d + c d' - 0.15 g = 0.15 x."""

    unsprung = 0.15
    truth = numpy.array([16.7, 1.5, 5.3, 1.0, 2000.0, 4.0])

    def linearise(self, ring, z, theta, x):
        u, d = z
        v, a = ring.derivatives(u)
        d_v, d_a = ring.derivatives(d)
        force, f_u, f_v, f_theta = oleo(theta, u, v)
        x_g = x + GRAVITY
        right = numpy.zeros((7, ring.n, 2))
        right[0, :, 0] = x_g - a - d_a - force
        right[0, :, 1] = force + self.unsprung * (x_g - d_a) - theta[4] * d - theta[5] * d_v
        for k in range(4):
            right[1 + k, :, 0] = -f_theta[k]
            right[1 + k, :, 1] = f_theta[k]
        right[5, :, 1] = -d
        right[6, :, 1] = -d_v
        middle = len(ring.first) // 2
        of_force = f_v[:, None] * ring.first
        of_force[:, middle] += f_u
        of_tyre = self.unsprung * ring.second + theta[5] * ring.first
        of_tyre[middle] += theta[4]
        return {(0, 0): ring.second + of_force, (0, 1): ring.second,
                (1, 0): -of_force, (1, 1): of_tyre}, right

    def other_start(self, ring, u, theta, x):
        """The tyre's equation is linear: solved harmonic by harmonic."""
        v, _ = ring.derivatives(u)
        load = oleo(theta, u, v)[0] + self.unsprung * (x + GRAVITY)
        load = numpy.fft.rfft(load[ring.place])
        w = 2.0 * numpy.pi / (ring.n * ring.step) * numpy.arange(len(load))
        d = load / (theta[4] - self.unsprung * w * w + 1j * theta[5] * w)
        return numpy.fft.irfft(d, ring.n)[ring.point]


class Presliding:
    """u'' + F(u, u') + f_c s - g = x;  z0 s' = u' - |u'|_e s."""

    rounding = 1e-3
    truth = numpy.array([13.3, 1.8, 4.3, 1.2, 0.5, 0.001])

    def linearise(self, ring, z, theta, x):
        u, s = z
        v, a = ring.derivatives(u)
        s_v, _ = ring.derivatives(s)
        force, f_u, f_v, f_theta = oleo(theta, u, v)
        size = numpy.sqrt(v * v + self.rounding**2)
        right = numpy.zeros((7, ring.n, 2))
        right[0, :, 0] = x + GRAVITY - a - force - theta[4] * s
        right[0, :, 1] = v - size * s - theta[5] * s_v
        for k in range(4):
            right[1 + k, :, 0] = -f_theta[k]
        right[5, :, 0] = -s
        right[6, :, 1] = -s_v
        middle = len(ring.first) // 2
        uu = f_v[:, None] * ring.first + ring.second
        uu[:, middle] += f_u
        ss = numpy.tile(theta[5] * ring.first, (ring.n, 1))
        ss[:, middle] = size
        us = numpy.zeros(len(ring.first))
        us[middle] = theta[4]
        return {(0, 0): uu, (0, 1): us, (1, 0): (s * v / size - 1.0)[:, None] * ring.first,
                (1, 1): ss}, right

    def other_start(self, ring, u, theta, x):
        """The shear's equation is linear along a given motion."""
        v, _ = ring.derivatives(u)
        size = numpy.sqrt(v * v + self.rounding**2)
        middle = len(ring.first) // 2
        ss = numpy.tile(theta[5] * ring.first, (ring.n, 1))
        ss[:, middle] = size
        right = numpy.zeros((1, ring.n, 2))
        right[0, :, 1] = v
        one = numpy.zeros(len(ring.first))
        one[middle] = 1.0
        zero = numpy.zeros(len(ring.first))
        return ring.solve({(0, 0): one, (0, 1): zero, (1, 0): zero, (1, 1): ss},
                          right.reshape(1, -1)).reshape(ring.n, 2)[:, 1]


class Job:
    """Runs (frequency, samples of one period) of one model under the cosine of `amplitude`."""

    def __init__(self, model, runs, amplitude, grids, width):
        self.model, self.runs = model, runs
        self.levels = []
        for n in grids:
            level = []
            for frequency, samples in runs:
                ring = Ring(n, 1.0 / frequency, width)
                x = amplitude * numpy.cos(2.0 * numpy.pi * frequency * ring.time)
                at = ring.place[::n // len(samples)]
                level.append((ring, x, at, samples))
            self.levels.append(level)

    def fit(self, start, tolerance=1e-8, harmonics=8):
        theta = numpy.array(start)
        self.iterations = []
        solutions = None
        for level in self.levels:
            solutions = ([self.start(run, theta, harmonics) for run in level]
                         if solutions is None else
                         [self.refined(old, z, run) for old, z, run in
                          zip(coarser, solutions, level)])
            last = level is self.levels[-1]
            theta, steps = self.steps(level, solutions, theta, tolerance if last else 1e-3)
            self.iterations.append(steps)
            coarser = level
        return theta

    def start(self, run, theta, harmonics):
        ring, x, _, samples = run
        content = numpy.fft.rfft(samples)[:harmonics + 1]
        u = numpy.fft.irfft(content, ring.n)[ring.point] * (ring.n / len(samples))
        return numpy.stack([u, self.model.other_start(ring, u, theta, x)])

    @staticmethod
    def refined(old, z, run):
        coarse, fine = old[0], run[0]
        content = numpy.fft.rfft(z[:, coarse.place])
        return numpy.fft.irfft(content, fine.n)[:, fine.point] * (fine.n / coarse.n)

    def steps(self, level, solutions, theta, tolerance):
        """Gauss-Newton on theta and the solutions together. Changes `solutions`."""
        before = None
        for iteration in range(1, 41):
            residuals, rows, moves = [], [], []
            for (ring, x, at, samples), z in zip(level, solutions):
                blocks, right = self.model.linearise(ring, z, theta, x)
                move = ring.solve(blocks, right.reshape(len(right), -1)).reshape(-1, ring.n, 2)
                moves.append(move)
                residuals.append(samples - z[0, at] - move[0, at, 0])
                rows.append(move[1:, at, 0])
            residual, rows = numpy.concatenate(residuals), numpy.concatenate(rows, 1)
            scaled = rows * theta[:, None]
            self.normal = scaled @ scaled.T
            change = numpy.linalg.solve(self.normal, scaled @ residual)
            for z, move in zip(solutions, moves):
                z += move[0].T
                z += numpy.tensordot(change * theta, move[1:], 1).T
            theta = theta * (1.0 + change)
            step = numpy.abs(change).max()
            # What the next steps would still add, from the contraction of the last two.
            rate = step / before if before else 1.0
            if step < tolerance or (rate < 0.5 and step * rate < tolerance):
                return theta, iteration
            before = step
        raise ArithmeticError("did not converge")


def jobs(folder, coarse):
    def grids(coarse_points, n):
        return [n] if coarse == "none" else [coarse_points, n]

    read = lambda name: numpy.loadtxt(folder / name)
    j6, j7 = read("oleo_j6.txt"), read("oleo_j7.txt")
    on_tyre, presliding = OnTyre(), Presliding()
    yield "J6", Job(on_tyre, [(2.0, j6[:40]), (4.0, j6[40:])], 3.0, grids(40, 160), 3), \
        read("oleo_j6_reference.txt")
    for name, n in (("J7", 1600), ("J7_640", 640)):
        yield name, Job(presliding, [(2.0, j7)], 3.0, grids(160, n), 3), \
            read("oleo_j7_reference.txt")


def main():
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("folder", type=pathlib.Path)
    options.add_argument("--jobs", default="J6,J7,J7_640")
    options.add_argument("--times", type=int, default=21)
    options.add_argument("--coarse", choices=["auto", "none"], default="auto")
    options.add_argument("--json", action="store_true", help="one object a line")
    given = options.parse_args()
    for name, job, reference in jobs(given.folder, given.coarse):
        if name not in given.jobs.split(","):
            continue
        start = 1.05 * job.model.truth
        taken = []
        for _ in range(given.times):
            began = time.perf_counter()
            theta = job.fit(start)
            taken.append(1e3 * (time.perf_counter() - began))
        error = numpy.abs(theta / reference - 1.0).max()
        result = {"job": name, "median_ms": float(numpy.median(taken)), "least_ms": min(taken),
                  "error": float(error), "iterations": job.iterations}
        print(json.dumps(result) if given.json else
              f"{name:8} {result['median_ms']:9.3f} ms (least {result['least_ms']:.3f}), "
              f"error {error:.1e}, iterations {job.iterations}")


if __name__ == "__main__":
    main()
