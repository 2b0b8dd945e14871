#!/usr/bin/python3
"""Jobs J6 and J7 in NumPy and SciPy: what a user of these would write to be fast.

    bench/numpy_periodic.py REFERENCE_FOLDER [--jobs J6,J7,J7_640] [--times 21] [--json]
        [--one-grid]

REFERENCE_FOLDER holds oleo_j6.txt, oleo_j7.txt and their *_reference.txt. Prints for each job the
median and the least CPU time of a fit, its error against the reference, and its iterations.

Method: theta and the periodic solutions move together (Gauss-Newton), one linearisation of the
model a step. Derivatives in time are central differences on the ring. The ring is folded (points
0, n-1, 1, n-2, ...), so that its matrix is banded, without corners, and LAPACK factorises it. The
measured coordinate starts from the data's harmonics, the other one from its own equation along
that motion. The first steps use a grid of fewer points; `--one-grid` leaves them out.
"""
import argparse
import json
import pathlib
import time

import numpy
from scipy.linalg.lapack import dgbsv

GRAVITY = 9.80665

# Differences of sixth order: weights of the first and second derivative at unit spacing.
MIDDLE = 3
WEIGHTS = numpy.array([[-3, 27, -135, 0, 135, -27, 3], [2, -27, 270, -490, 270, -27, 2]]) / 180.0


class Rings:
    """A period of each run on n equal steps, two unknowns a point, all runs one after the other.

    All arrays are in folded order.
    """

    def __init__(self, n, frequencies):
        self.n, self.runs, self.size = n, len(frequencies), n * len(frequencies)
        point = numpy.empty(n, int)  # the point at each place of a folded ring
        point[0::2] = numpy.arange((n + 1) // 2)
        point[1::2] = numpy.arange(n - 1, (n + 1) // 2 - 1, -1)
        place = numpy.argsort(point)
        around = place[(point[:, None] + numpy.arange(-MIDDLE, MIDDLE + 1)) % n]
        shift = n * numpy.arange(self.runs)
        self.point = (point + shift[:, None]).ravel()
        self.place = place + shift[:, None]  # runs x n: from folded to ordered
        self.around = (around + shift[:, None, None]).reshape(self.size, -1)
        self.phase = 2.0 * numpy.pi / n * numpy.tile(point, self.runs)
        self.angular = 2.0 * numpy.pi * numpy.array(frequencies)[:, None]
        rate = n * numpy.repeat(frequencies, n)  # points a second
        self.rates = numpy.stack([rate, rate**2])
        self.first = rate[:, None] * WEIGHTS[0]
        self.second = (rate**2)[:, None] * WEIGHTS[1]
        # Address, in LAPACK's band, of the derivative of row `r` of a place over unknown `c` of
        # its neighbours.
        self.band = 4 * MIDDLE + 1
        rows = 3 * self.band + 1
        row = 2 * numpy.arange(self.size)[:, None]
        self.address = {(r, c): 2 * self.band + (row + r) + (2 * self.around + c) * (rows - 1)
                        for r in (0, 1) for c in (0, 1)}
        self.matrix = numpy.empty((2 * self.size, rows))

    def derivatives(self, u):
        return self.rates * (WEIGHTS @ u[self.around].T)

    def solve(self, blocks, right):
        """A z = right for each row of `right`. blocks[r, c]: derivatives over the neighbours, or
        over the point alone."""
        self.matrix.fill(0.0)
        flat = self.matrix.reshape(-1)
        for key, values in blocks.items():
            address = self.address[key]
            flat[address if values.ndim == 2 else address[:, MIDDLE]] = values
        shape = right.shape
        right = right.reshape(len(right), -1)
        _, _, z, info = dgbsv(self.band, self.band, self.matrix.T, right.T, overwrite_ab=True,
                              overwrite_b=True)
        if info:
            raise ArithmeticError("singular")
        return z.T.reshape(shape)

    def harmonics(self, u):
        return numpy.fft.rfft(u[..., self.place]) / self.n

    def from_harmonics(self, content):
        u = numpy.fft.irfft(content, self.n) * self.n
        return u.reshape(*u.shape[:-2], -1)[..., self.point]


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

    def linearise(self, rings, z, theta, x):
        """Derivatives of both equations, and what is missing in them, then -d/dtheta."""
        u, d = z
        v, a = rings.derivatives(u)
        d_v, d_a = rings.derivatives(d)
        force, f_u, f_v, f_theta = oleo(theta, u, v)
        x_g = x + GRAVITY
        right = numpy.zeros((7, rings.size, 2))
        right[0, :, 0] = x_g - a - d_a - force
        right[0, :, 1] = force + self.unsprung * (x_g - d_a) - theta[4] * d - theta[5] * d_v
        right[1:5, :, 1] = f_theta
        right[1:5, :, 0] = -right[1:5, :, 1]
        right[5, :, 1] = -d
        right[6, :, 1] = -d_v
        of_force = f_v[:, None] * rings.first
        of_force[:, MIDDLE] += f_u
        of_tyre = self.unsprung * rings.second + theta[5] * rings.first
        of_tyre[:, MIDDLE] += theta[4]
        return {(0, 0): rings.second + of_force, (0, 1): rings.second,
                (1, 0): -of_force, (1, 1): of_tyre}, right

    def other_start(self, rings, u, theta, x):
        """The tyre's equation is linear along a given motion: solved harmonic by harmonic."""
        v, _ = rings.derivatives(u)
        load = rings.harmonics(oleo(theta, u, v)[0] + self.unsprung * (x + GRAVITY))
        w = rings.angular * numpy.arange(load.shape[-1])
        return rings.from_harmonics(load / (theta[4] - self.unsprung * w * w + 1j * theta[5] * w))


class Presliding:
    """u'' + F(u, u') + f_c s - g = x;  z0 s' = u' - |u'|_e s."""

    rounding = 1e-3
    truth = numpy.array([13.3, 1.8, 4.3, 1.2, 0.5, 0.001])

    def linearise(self, rings, z, theta, x):
        u, s = z
        v, a = rings.derivatives(u)
        s_v, _ = rings.derivatives(s)
        force, f_u, f_v, f_theta = oleo(theta, u, v)
        size = numpy.sqrt(v * v + self.rounding**2)
        right = numpy.zeros((7, rings.size, 2))
        right[0, :, 0] = x + GRAVITY - a - force - theta[4] * s
        right[0, :, 1] = v - size * s - theta[5] * s_v
        right[1:5, :, 0] = f_theta
        right[1:5, :, 0] *= -1.0
        right[5, :, 0] = -s
        right[6, :, 1] = -s_v
        of_motion = f_v[:, None] * rings.first
        of_motion += rings.second
        of_motion[:, MIDDLE] += f_u
        return {(0, 0): of_motion, (0, 1): numpy.full(rings.size, theta[4]),
                (1, 0): (s * v / size - 1.0)[:, None] * rings.first,
                (1, 1): self.of_shear(rings, size, theta)}, right

    @staticmethod
    def of_shear(rings, size, theta):
        block = theta[5] * rings.first
        block[:, MIDDLE] = size
        return block

    def other_start(self, rings, u, theta, x):
        """The shear's equation is linear along a given motion."""
        v, _ = rings.derivatives(u)
        size = numpy.sqrt(v * v + self.rounding**2)
        right = numpy.zeros((1, rings.size, 2))
        right[0, :, 1] = v
        return rings.solve({(0, 0): numpy.ones(rings.size),
                            (1, 1): self.of_shear(rings, size, theta)}, right)[0, :, 1]


class Job:
    """One period of each run, a row of `samples`, of one model under cosines of one amplitude."""

    def __init__(self, model, frequencies, samples, amplitude, grids):
        self.model, self.samples = model, samples
        self.data = samples.ravel()
        self.levels = []
        for n in grids:
            rings = Rings(n, frequencies)
            at = rings.place[:, ::n // samples.shape[1]].ravel()
            self.levels.append((rings, amplitude * numpy.cos(rings.phase), at))

    def fit(self, start, tolerance=1e-8, approach=1e-2, harmonics=8):
        theta = numpy.array(start)
        self.iterations = []
        coarser = None
        for rings, x, at in self.levels:
            if coarser is None:
                content = numpy.fft.rfft(self.samples)[:, :harmonics + 1] / self.samples.shape[1]
                u = rings.from_harmonics(content)
                z = numpy.stack([u, self.model.other_start(rings, u, theta, x)])
            else:
                z = rings.from_harmonics(coarser.harmonics(z))
            last = rings is self.levels[-1][0]
            theta, z = self.steps(rings, x, at, z, theta, tolerance if last else approach)
            coarser = rings
        return theta

    def steps(self, rings, x, at, z, theta, tolerance):
        """Gauss-Newton on theta and the solutions together."""
        before = None
        for iteration in range(1, 41):
            moves = rings.solve(*self.model.linearise(rings, z, theta, x))
            rows = moves[1:, at, 0] * theta[:, None]
            residual = self.data - z[0, at] - moves[0, at, 0]
            change = numpy.linalg.solve(rows @ rows.T, rows @ residual)
            weights = numpy.concatenate([[1.0], change * theta])
            z = z + (weights @ moves.reshape(7, -1)).reshape(-1, 2).T
            theta = theta * (1.0 + change)
            step = numpy.abs(change).max()
            # What the next steps would still add, from the contraction of the last two.
            rate = step / before if before else 1.0
            if step < tolerance or (rate < 0.5 and step * rate < tolerance):
                self.iterations.append(iteration)
                return theta, z
            before = step
        raise ArithmeticError("did not converge")


def jobs(folder, coarse):
    """(name, job, optimum) of each."""

    def grids(coarse_points, n):
        return [coarse_points, n] if coarse else [n]

    j6, j7, optimum6, optimum7 = (
        numpy.loadtxt(folder / f"oleo_{name}.txt")
        for name in ("j6", "j7", "j6_reference", "j7_reference"))
    yield "J6", Job(OnTyre(), [2.0, 4.0], j6.reshape(2, 40), 3.0, grids(40, 160)), optimum6
    for name, n in (("J7", 1600), ("J7_640", 640)):
        yield name, Job(Presliding(), [2.0], j7.reshape(1, 40), 3.0, grids(80, n)), optimum7


def main():
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("folder", type=pathlib.Path)
    options.add_argument("--jobs", default="J6,J7,J7_640")
    options.add_argument("--times", type=int, default=21)
    options.add_argument("--one-grid", action="store_true", help="no steps on a coarse grid first")
    options.add_argument("--json", action="store_true", help="one object a line")
    given = options.parse_args()
    for name, job, reference in jobs(given.folder, not given.one_grid):
        if name not in given.jobs.split(","):
            continue
        start = 1.05 * job.model.truth
        taken = []
        for _ in range(given.times):
            began = time.process_time()
            theta = job.fit(start)
            taken.append(1e3 * (time.process_time() - began))
        error = numpy.abs(theta / reference - 1.0).max()
        result = {"job": name, "median_ms": float(numpy.median(taken)), "least_ms": min(taken),
                  "error": float(error), "iterations": job.iterations}
        print(json.dumps(result) if given.json else
              f"{name:8} {result['median_ms']:9.3f} ms (least {result['least_ms']:.3f}), "
              f"error {error:.1e}, iterations {job.iterations}")


if __name__ == "__main__":
    main()
