#!/usr/bin/python3
"""Makes the data of several channels, and what maximum likelihood says of them, by other means than
the library's: Runge-Kutta steps of 1/1600 of a period and shooting for the periodic solution, central
differences for its sensitivities, numpy for the rest. Writes NAME.csv and reference.json beside itself.
The optimum is checked by differences of the likelihood itself."""
import json
import pathlib

import numpy as np

HERE = pathlib.Path(__file__).resolve().parent
STEPS, POINTS = 1600, 40
G = 9.80665


def oleo_force(th, u, v):
    return th[0] * np.abs(v) * v + th[1] * (1 - th[2] * u) ** -th[3]


class Oscillator:  # (6.2): c, k
    name, truth, frequency, amplitude, states = "linear", [2.0, 120.0], 2.0, 3.0, 2
    channels = ["displacement", "acceleration"]
    deviation, correlation = [2e-4, 3e-2], 0.6

    def rate(self, th, z, x):
        u, v = z
        return np.array([v, x - th[0] * v - th[1] * u])

    def channel(self, th, z, x):
        u, v = z
        return [u, th[0] * v + th[1] * u]

    rest = staticmethod(lambda th: [0.0, 0.0])


class Oleo:  # (6.3)
    name, truth, frequency, amplitude, states = "oleo", [5.08 / .3048, 5 * .3048, 1.62 / .3048, 1.0], 2.0, 3.048, 2
    channels = ["displacement", "acceleration", "force"]
    deviation, correlation = [4e-4, 5e-2, 1e-1], 0.7

    def rate(self, th, z, x):
        u, v = z
        return np.array([v, x + G - oleo_force(th, u, v)])

    def channel(self, th, z, x):
        u, v = z
        f = oleo_force(th, u, v)
        return [u, f - G, f]

    rest = staticmethod(lambda th: [(1 - (th[1] / G) ** (1 / th[3])) / th[2], 0.0])


class OleoOnTyre:  # unsprung mass a tenth; tyre k, c over the sprung mass
    name, frequency, amplitude, states = "tyre", 2.0, 3.048, 4
    truth = [5.08 / .3048, 5 * .3048, 1.62 / .3048, 1.0, 900.0, 3.0]
    channels = ["displacement", "acceleration"]
    deviation, correlation = [2e-4, 2e-2], -0.5
    ratio = 0.1

    def rate(self, th, z, x):
        u, v, d, e = z
        f = oleo_force(th, u, v)
        tyre = (f - th[4] * d - th[5] * e) / self.ratio + G + x
        return np.array([v, x + G - f - tyre, e, tyre])

    def channel(self, th, z, x):
        u, v, _, _ = z
        return [u, oleo_force(th, u, v) - G]

    def rest(self, th):
        return [(1 - (th[1] / G) ** (1 / th[3])) / th[2], 0.0, G * (1 + self.ratio) / th[4], 0.0]


def period(model, th, z, keep=False):
    """One period from z (states x K) for the K columns of th."""
    h = 1.0 / model.frequency / STEPS
    x = lambda i: model.amplitude * np.cos(2 * np.pi * i / STEPS)
    out = []
    for i in range(STEPS):
        if keep and i % (STEPS // POINTS) == 0:
            out.append(np.array(model.channel(th, z, x(i))))
        k1 = model.rate(th, z, x(i))
        k2 = model.rate(th, z + h / 2 * k1, x(i + .5))
        k3 = model.rate(th, z + h / 2 * k2, x(i + .5))
        k4 = model.rate(th, z + h * k3, x(i + 1))
        z = z + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
    return (z, np.array(out)) if keep else z


def predict(model, th, start=None):
    """points x channels x K, and the initial states."""
    th = np.array(th, float)
    count, s = th.shape[1], model.states
    if start is None:
        start = np.array([x * np.ones(count) for x in model.rest(th)])
        for _ in range(20):
            start = period(model, th, start)
    z = np.array(start) * np.ones((s, count))
    for _ in range(12):
        wide = np.concatenate([z] + [z + 1e-6 * np.eye(s)[:, [k]] for k in range(s)], axis=1)
        ends = period(model, np.tile(th, s + 1), wide)
        off = ends[:, :count] - z
        if np.abs(off).max() < 1e-13:
            break
        for c in range(count):
            slope = np.array([(ends[:, (1 + k) * count + c] - ends[:, c]) / 1e-6 for k in range(s)]).T
            z[:, c] += np.linalg.solve(np.eye(s) - slope, off[:, c])
    return period(model, th, z, keep=True)[1], z


def log_det(moment, joint):
    return np.linalg.slogdet(moment)[1] if joint else np.log(np.diag(moment)).sum()


def fit(model, y, joint):
    th = np.array(model.truth) * 1.02
    start = None
    p = len(th)
    for _ in range(60):
        step = 1e-5 * np.abs(th)
        wide = np.column_stack([th] + [th + s * step[k] * np.eye(p)[k] for k in range(p) for s in (1, -1)])
        values, states = predict(model, wide, start)
        start = states[:, [0]]
        e = y - values[:, :, 0]
        j = np.array([(values[:, :, 1 + 2 * k] - values[:, :, 2 + 2 * k]) / (2 * step[k]) for k in range(p)])
        v = e.T @ e / len(y)
        if not joint:
            v = np.diag(np.diag(v))
        w = np.linalg.inv(v)
        gram = np.einsum("kia,ab,lib->kl", j, w, j)
        delta = np.linalg.solve(gram, np.einsum("kia,ab,ib->k", j, w, e))
        th = th + delta
        if np.abs(delta / th).max() < 1e-10:
            break
    values, _ = predict(model, th[:, None], start)
    e = y - values[:, :, 0]
    moment = e.T @ e
    # the likelihood itself, by differences: its slope against its bend
    error = np.sqrt(np.diag(np.linalg.inv(gram)))
    alone = 1 / np.sqrt(np.diag(gram))
    for k in range(p):
        side = [len(y) / 2 * log_det((lambda r: r.T @ r)(y - predict(
            model, (th + s * .05 * alone[k] * np.eye(p)[k])[:, None], start)[0][:, :, 0]), joint) for s in (1, -1)]
        assert abs(side[0] - side[1]) / (2 * .05) < 2e-3, (model.name, k, side)
    v = moment / len(y)
    if not joint:
        v = np.diag(np.diag(v))
    n, m = y.shape
    likelihood = -0.5 * (n * m * np.log(2 * np.pi) + n * np.linalg.slogdet(v)[1] + n * m)
    return {"theta": list(th), "covariance": v.tolist(), "log_likelihood": likelihood,
            "information_error": list(error)}


def main():
    random = np.random.default_rng(31)
    reference = {}
    for model in (Oscillator(), Oleo(), OleoOnTyre()):
        exact = predict(model, np.array(model.truth)[:, None])[0][:, :, 0]
        s = np.diag(model.deviation)
        m = len(model.deviation)
        v = s @ (model.correlation * np.ones((m, m)) + (1 - model.correlation) * np.eye(m)) @ s
        y = exact + random.multivariate_normal(np.zeros(m), v, size=POINTS)
        y = np.array([[float(f"{x:.12g}") for x in row] for row in y])
        with open(HERE / f"{model.name}.csv", "w", encoding="ascii") as file:
            file.write("t," + ",".join(model.channels) + "\n")
            for i, row in enumerate(y):
                file.write(f"{i / POINTS / model.frequency:.12g}," + ",".join(f"{x:.12g}" for x in row) + "\n")
        reference[model.name] = {
            "truth": model.truth, "frequency_hz": model.frequency, "amplitude": model.amplitude,
            "independent": fit(model, y, False), "joint": fit(model, y, True)}
        print(model.name, reference[model.name]["joint"]["theta"])
    (HERE / "reference.json").write_text(json.dumps(reference, indent=1) + "\n", encoding="ascii")


if __name__ == "__main__":
    main()
