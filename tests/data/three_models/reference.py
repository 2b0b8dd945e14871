#!/usr/bin/python3
"""Displacement records of the linear oscillator (6.2), the oleo (6.3) and the oleo on its tyre, and what
the objectives of chapter 3 make of them, by other means than the library's: Runge-Kutta steps with the
variational equations by hand, shooting for the periodic solution, Gauss-Newton on normal equations. Plain
Python. Writes MODEL.csv and reference.json beside itself; takes some minutes."""
import json
import math
import pathlib
import random

HERE = pathlib.Path(__file__).resolve().parent
STEPS, POINTS = 2000, 40
G = 9.80665


def solve(a, b):
    """a x = b by elimination with row exchanges; b may have several columns."""
    n = len(a)
    m = [list(a[i]) + (list(b[i]) if isinstance(b[i], (list, tuple)) else [b[i]]) for i in range(n)]
    for c in range(n):
        p = max(range(c, n), key=lambda r: abs(m[r][c]))
        m[c], m[p] = m[p], m[c]
        for r in range(n):
            if r != c and m[r][c]:
                q = m[r][c] / m[c][c]
                m[r] = [x - q * y for x, y in zip(m[r], m[c])]
    out = [[x / m[i][i] for x in m[i][n:]] for i in range(n)]
    return [row[0] for row in out] if not isinstance(b[0], (list, tuple)) else out


def inverse(a):
    return solve(a, [[float(i == j) for j in range(len(a))] for i in range(len(a))])


def oleo_force(th, u, v):
    """Force, its slopes over u and v, and over the four parameters."""
    s = 1 - th[2] * u
    gas = s ** -th[3]
    f = th[0] * abs(v) * v + th[1] * gas
    return (f, th[1] * th[3] * th[2] * gas / s, 2 * th[0] * abs(v),
            [abs(v) * v, gas, th[1] * th[3] * u * gas / s, -th[1] * gas * math.log(s)])


class Linear:
    name, truth, states = "linear", [2.0, 120.0], 2
    runs, deviation = [(2.0, 3.0), (1.0, 3.0)], 2e-4
    prior = (1, 121.0, 0.4)  # parameter, mean, standard deviation
    start = [0.02, 0.3]

    def rest(self, th):
        return [0.0, 0.0]

    def rate(self, th, z, columns, x):
        u, v = z
        f = [v, x - th[0] * v - th[1] * u]
        out = []
        for k, (du, dv) in enumerate(columns):
            extra = (v if k == 2 else u if k == 3 else 0.0)
            out.append((dv, -th[0] * dv - th[1] * du - extra))
        return f, out


class Oleo:
    name, truth, states = "oleo", [5.08 / .3048, 5 * .3048, 1.62 / .3048, 1.0], 2
    runs, deviation = [(2.0, 3.048), (1.0, 3.048)], 1e-4
    prior = (3, 1.01, 0.01)
    start = [0.10, 0.2]

    def rest(self, th):
        return [(1 - (th[1] / G) ** (1 / th[3])) / th[2], 0.0]

    def rate(self, th, z, columns, x):
        u, v = z
        f, fu, fv, ft = oleo_force(th, u, v)
        out = []
        for k, (du, dv) in enumerate(columns):
            out.append((dv, -fu * du - fv * dv - (ft[k - 2] if k >= 2 else 0.0)))
        return [v, x + G - f], out


class Tyre:  # unsprung mass a tenth; stiffness and damping over the sprung mass
    name, states = "tyre", 4
    truth = [5.08 / .3048, 5 * .3048, 1.62 / .3048, 1.0, 900.0, 3.0]
    runs, deviation = [(2.0, 3.048), (4.0, 6.0)], 5e-5
    prior = (4, 905.0, 8.0)
    start = [0.15, 0.3, 0.012, -0.1]
    ratio = 0.1

    def rest(self, th):
        return [(1 - (th[1] / G) ** (1 / th[3])) / th[2], 0.0, G * (1 + self.ratio) / th[4], 0.0]

    def rate(self, th, z, columns, x):
        u, v, d, e = z
        f, fu, fv, ft = oleo_force(th, u, v)
        wheel = (f - th[4] * d - th[5] * e) / self.ratio + G + x
        out = []
        for k, (du, dv, dd, de) in enumerate(columns):
            g = fu * du + fv * dv + (ft[k - 4] if 4 <= k < 8 else 0.0)
            t = g - th[4] * dd - th[5] * de
            if k == 8:
                t -= d
            if k == 9:
                t -= e
            t /= self.ratio
            out.append((dv, -g - t, de, t))
        return [v, x + G - f - wheel, e, wheel], out


def march(model, th, z, frequency, amplitude, steps, keep_every, total, slopes=True):
    """`total` steps of 1 / (frequency steps) s from z with its derivatives over z(0) and theta; u and
    du/d(z(0), theta) at every `keep_every`-th."""
    s, p = model.states, len(th)
    h = 1.0 / frequency / steps
    columns = [tuple(float(i == k) for i in range(s)) for k in range(s + p)] if slopes else []
    kept = []

    def moved(y, k, a):
        return [i + a * j for i, j in zip(y, k)]

    for i in range(total + 1):
        if i % keep_every == 0:
            kept.append((z[0], [c[0] for c in columns]))
        if i == total:
            break
        turn = 2 * math.pi / steps
        x0, xm, x1 = (amplitude * math.cos(turn * (i + a)) for a in (0, .5, 1))
        k1, c1 = model.rate(th, z, columns, x0)
        k2, c2 = model.rate(th, moved(z, k1, h / 2), [moved(c, d, h / 2) for c, d in zip(columns, c1)], xm)
        k3, c3 = model.rate(th, moved(z, k2, h / 2), [moved(c, d, h / 2) for c, d in zip(columns, c2)], xm)
        k4, c4 = model.rate(th, moved(z, k3, h), [moved(c, d, h) for c, d in zip(columns, c3)], x1)
        z = [a + h / 6 * (b + 2 * c + 2 * d + e) for a, b, c, d, e in zip(z, k1, k2, k3, k4)]
        columns = [tuple(a + h / 6 * (b + 2 * c + 2 * d + e) for a, b, c, d, e in zip(*five))
                   for five in zip(columns, c1, c2, c3, c4)]
    return z, columns, kept


class Periodic:
    """u and du/dtheta of the periodic solution of each run, the last one the start of the next."""

    def __init__(self, model, steps=STEPS):
        self.model, self.steps, self.at = model, steps, {}

    def __call__(self, th):
        m, s = self.model, self.model.states
        u, rows = [], []
        for run in m.runs:
            z = self.at.get(run)
            if z is None:
                z = m.rest(th)
                for _ in range(12):
                    z = march(m, th, z, *run, self.steps, 1, self.steps, False)[0]
            for _ in range(30):
                end, columns, kept = march(m, th, z, *run, self.steps, self.steps // POINTS, self.steps)
                gap = [[float(i == k) - columns[k][i] for k in range(s)] for i in range(s)]
                step = solve(gap, [e - b for e, b in zip(end, z)])
                z = [a + b for a, b in zip(z, step)]
                if max(map(abs, step)) < 1e-13:
                    break
            self.at[run] = z
            over = solve(gap, [[columns[s + k][i] for k in range(len(th))] for i in range(s)])
            for value, slope in kept[:POINTS]:
                u.append(value)
                rows.append([slope[s + k] + sum(slope[i] * over[i][k] for i in range(s))
                             for k in range(len(th))])
        return u, rows


def normal(rows, weight):
    p = len(rows[0])
    return [[sum(w * r[a] * r[b] for r, w in zip(rows, weight)) for b in range(p)] for a in range(p)]


def gauss_newton(predict, y, theta, weight, extra=None, held=None):
    """Least sum of weight (y - u)^2, plus ((theta_k - mean) / deviation)^2 where `extra` says so, with
    theta_held where it is."""
    th = list(theta)
    for _ in range(40):
        u, rows = predict(th)
        w = weight(y, u) if callable(weight) else weight
        gram = normal(rows, w)
        right = [sum(c * r[a] * (d - b) for r, c, d, b in zip(rows, w, y, u)) for a in range(len(th))]
        if extra:
            k, mean, deviation = extra
            gram[k][k] += deviation ** -2
            right[k] += (mean - th[k]) * deviation ** -2
        if held is not None:
            for a in range(len(th)):
                gram[held][a] = gram[a][held] = float(a == held)
            right[held] = 0.0
        step = solve(gram, right)
        th = [a + b for a, b in zip(th, step)]
        if max(abs(a / b) for a, b in zip(step, th)) < 1e-11:
            break
    u, rows = predict(th)
    return th, u, rows, gram


def sum_of(y, u, weight):
    return sum(w * (a - b) ** 2 for w, a, b in zip(weight, y, u))


def upper_median(values):
    return sorted(values)[len(values) // 2]


def harmonics(values, count):
    n = len(values)
    out = [sum(values) / n]
    for h in range(1, (count - 1) // 2 + 1):
        for f in (math.cos, math.sin):
            out.append(2 / n * sum(v * f(2 * math.pi * h * j / n) for j, v in enumerate(values)))
    return out


def profile_end(predict, y, best, side, k, error, target):
    """Where the sum of squares, the others fitted anew, has risen by `target`, by secants on its root."""
    least = sum_of(y, best[1], [1.0] * len(y))
    th, t = list(best[0]), 0.0
    points = [(0.0, 0.0)]
    shift = side * error * math.sqrt(target[1])
    for _ in range(12):
        th = list(th)
        th[k] = best[0][k] + shift
        th, u, _, _ = gauss_newton(predict, y, th, [1.0] * len(y), held=k)
        t = math.sqrt(max(0.0, sum_of(y, u, [1.0] * len(y)) - least))
        if abs(t - math.sqrt(target[0])) < 1e-9 * t:
            break
        points.append((shift, t))
        (a, ta), (b, tb) = points[-2:]
        shift = b + (math.sqrt(target[0]) - tb) * (b - a) / (tb - ta)
    return best[0][k] + shift


def bounded_case(predict, y, best, k, error):
    """With theta_k at least one and a half errors above where it would be: it stays on that bound."""
    th = list(best[0])
    th[k] += 1.5 * error
    th, u, _, _ = gauss_newton(predict, y, th, [1.0] * len(y), held=k)
    return {"parameter": k, "lower": th[k], "theta": th, "sum_of_squares": sum_of(y, u, [1.0] * len(y))}


def student(degrees):
    """97.5 % quantile, by Simpson's rule and bisection."""
    scale = math.exp(math.lgamma((degrees + 1) / 2) - math.lgamma(degrees / 2)) / math.sqrt(degrees * math.pi)

    def mass(t, n=2000):
        h = t / n
        f = lambda x: scale * (1 + x * x / degrees) ** (-(degrees + 1) / 2)
        return h / 3 * sum((1 if i in (0, n) else 4 if i % 2 else 2) * f(i * h) for i in range(n + 1))

    low, high = 1.0, 20.0
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (middle, high) if mass(middle) < 0.475 else (low, middle)
    return low


def huber_case(model, predict, y, ones):
    """Three readings are wrong by 30 standard deviations."""
    spoilt = list(y)
    for j, sign in ((7, 1), (22, -1), (61, 1)):
        spoilt[j] += sign * 30 * model.deviation

    def huber(data, fit):
        e = [a - b for a, b in zip(data, fit)]
        scale = upper_median([abs(x) for x in e]) / 0.6744897501960817
        huber.scale = scale
        return [min(1.0, 1.345 * scale / abs(x)) if x else 1.0 for x in e]

    th = gauss_newton(predict, spoilt, model.truth, ones)[0]
    for _ in range(15):
        th = gauss_newton(predict, spoilt, th, huber)[0]
    return {"theta": th, "scale": huber.scale, "spoilt": spoilt}


def harmonics_case(model, predict, y):
    """Mean cycles as seven coefficients each, with a covariance that is not diagonal."""
    count, p = 7, len(model.truth)
    covariance = [[model.deviation ** 2 * (0.3 if i == j else 0.2 * 0.6 ** abs(i - j)) for j in range(count)]
                  for i in range(count)]
    precision = inverse(covariance)
    runs = len(model.runs)
    z = [harmonics(y[r * POINTS:(r + 1) * POINTS], count) for r in range(runs)]
    th = list(model.truth)
    for _ in range(40):
        u, rows = predict(th)
        gram = [[0.0] * p for _ in range(p)]
        right = [0.0] * p
        for r in range(runs):
            part = slice(r * POINTS, (r + 1) * POINTS)
            e = [a - b for a, b in zip(z[r], harmonics(u[part], count))]
            j = [harmonics([row[k] for row in rows[part]], count) for k in range(p)]
            pj = [[sum(precision[a][b] * j[k][b] for b in range(count)) for a in range(count)] for k in range(p)]
            for k in range(p):
                right[k] += sum(pj[k][a] * e[a] for a in range(count))
                for l in range(p):
                    gram[k][l] += sum(pj[k][a] * j[l][a] for a in range(count))
        step = solve(gram, right)
        th = [a + b for a, b in zip(th, step)]
        if max(abs(a / b) for a, b in zip(step, th)) < 1e-11:
            break
    return {"theta": th, "covariance": inverse(gram), "coefficients": z,
            "coefficient_covariance": covariance}


def periodic_cases(model, y):
    predict = Periodic(model)
    ones = [1.0] * len(y)
    n, p = len(y), len(model.truth)
    out = {}
    best = gauss_newton(predict, y, model.truth, ones)
    th, u, rows, gram = best
    check = gauss_newton(Periodic(model, STEPS // 2), y, th, ones)[0]
    print(model.name, "steps twice as long move theta by", max(abs(a / b - 1) for a, b in zip(check, th)))
    variance = sum_of(y, u, ones) / (n - p)
    bread = inverse(gram)
    out["least_squares"] = {"theta": th, "sum_of_squares": sum_of(y, u, ones),
                            "covariance": [[variance * x for x in row] for row in bread]}
    squares = [(a - b) ** 2 for a, b in zip(y, u)]
    meat = normal(rows, squares)
    half = [[sum(bread[i][k] * meat[k][j] for k in range(p)) for j in range(p)] for i in range(p)]
    out["sandwich"] = [[n / (n - p) * sum(half[i][k] * bread[k][j] for k in range(p)) for j in range(p)]
                       for i in range(p)]
    t = student(n - p)
    target = (t * t * variance, t * t)
    k = model.prior[0]
    error = math.sqrt(variance * bread[k][k])
    out["profile"] = {"parameter": k, "ends": [profile_end(predict, y, best, s, k, error, target) for s in (-1, 1)]}

    out["bounded"] = bounded_case(predict, y, best, k, error)

    weight = [4.0 if j % 3 == 0 else 1.0 for j in range(n)]
    th, u, rows, gram = gauss_newton(predict, y, model.truth, weight)
    variance = sum_of(y, u, weight) / (n - p)
    out["weighted"] = {"theta": th, "covariance": [[variance * x for x in row] for row in inverse(gram)]}

    known = [model.deviation ** -2] * n
    th, u, rows, gram = gauss_newton(predict, y, model.truth, known, model.prior)
    out["map"] = {"theta": th, "covariance": inverse(gram), "prior": list(model.prior), "noise": model.deviation}

    out["huber"] = huber_case(model, predict, y, ones)
    out["harmonics"] = harmonics_case(model, predict, y)
    return out


def transient_case(model, source):
    """60 samples over one and a half periods of the first run from a state off the orbit; that state
    unknown."""
    frequency, amplitude = model.runs[0]
    every, samples, s = STEPS // 40, 60, model.states

    def predict(all_):
        kept = march(model, all_[s:], list(all_[:s]), frequency, amplitude, STEPS, every, every * (samples - 1))[2]
        return [k[0] for k in kept], [k[1] for k in kept]

    exact = predict(model.start + model.truth)[0]
    y = [float(f"{u + source.gauss(0, model.deviation):.12g}") for u in exact]
    th, u, _, gram = gauss_newton(predict, y, model.start + model.truth, [1.0] * samples)
    variance = sum_of(y, u, [1.0] * samples) / (samples - len(th))
    return {"t": [i / 40 / frequency for i in range(samples)], "displacement": y,
            "initial": th[:s], "theta": th[s:], "errors": [math.sqrt(variance * inverse(gram)[i][i]) for i in range(len(th))]}


def main():
    reference = {}
    for number, model in enumerate((Linear(), Oleo(), Tyre())):
        source = random.Random(1991 + number)
        exact = Periodic(model)(model.truth)[0]
        y = [float(f"{u + source.gauss(0, model.deviation):.12g}") for u in exact]
        with open(HERE / f"{model.name}.csv", "w", encoding="ascii") as file:
            file.write("run,tau,displacement\n")
            for j, u in enumerate(y):
                file.write(f"{j // POINTS},{j % POINTS / POINTS:.12g},{u:.12g}\n")
        reference[model.name] = {"truth": model.truth, "runs": [list(r) for r in model.runs],
                                 **periodic_cases(model, y), "transient": transient_case(model, source)}
        print(model.name, reference[model.name]["least_squares"]["theta"], reference[model.name]["transient"]["theta"])
    (HERE / "reference.json").write_text(json.dumps(reference, indent=1) + "\n", encoding="ascii")


if __name__ == "__main__":
    main()
