#!/usr/bin/python3
"""Responses of the oleo (6.3) and of the oleo on its tyre that repeat only after two or three periods of the
excitation, and where the response of one period doubles, by other means than the library's: extrapolated
midpoint steps (Gragg, Bulirsch, Stoer) that end on every reversal of the stroke, where |v| v has its corner;
settling; Newton's method on the period map, whose derivative is by central differences. Plain Python. Writes
reference.json beside itself; takes some minutes."""
import json
import math
import pathlib

HERE = pathlib.Path(__file__).resolve().parent
G = 9.80665
SAMPLES = 48  # a period
DIVISIONS = (2, 4, 6, 8, 10)
PAPER = [5.08 / .3048, 5 * .3048, 1.62 / .3048, 1.0]

# The start is only where settling begins, found by trying many.
CASES = {
    # The paper's own oleo, shaken harder than there.
    "oleo_two": dict(theta=PAPER, periods=2, frequency=4.0, amplitude=40.0, start=[0.16, 0.8]),
    # A weaker orifice.
    "oleo_three": dict(theta=[6.0] + PAPER[1:], periods=3, frequency=8.5, amplitude=28.0, start=[0.06, 0.8]),
    "tyre_two": dict(theta=[6.0] + PAPER[1:] + [2000.0, 6.0], periods=2, frequency=5.0, amplitude=12.0,
                     start=[0.16, 0.8, 0.005, 0.0]),
    "tyre_three": dict(theta=[3.0] + PAPER[1:] + [2000.0, 6.0], periods=3, frequency=7.5, amplitude=12.0,
                       start=[0.06, 0.8, 0.005, 0.0]),
}
# Along the response of one period: frequency, and an amplitude on either side of the doubling.
DOUBLINGS = {
    "oleo": dict(theta=PAPER, frequency=4.0, between=(20.0, 28.0)),
    "tyre": dict(theta=[6.0] + PAPER[1:] + [2000.0, 6.0], frequency=5.0, between=(4.0, 6.0)),
}
RATIO = 0.1  # unsprung mass over the sprung one


def rate(th, y, x, way):
    """`way` is the sign of the stroke's velocity, held over a step."""
    force = th[0] * way * y[1] * y[1] + th[1] * (1 - th[2] * y[0]) ** -th[3]
    if len(y) == 2:
        return [y[1], G + x - force]
    wheel = (force - th[4] * y[2] - th[5] * y[3]) / RATIO + G + x
    return [y[1], x + G - force - wheel, y[3], wheel]


def step(th, excitation, y, t, h, way):
    table = []
    for n in DIVISIONS:
        d = h / n
        a, b = y, [p + d * q for p, q in zip(y, rate(th, y, excitation(t), way))]
        for i in range(1, n):
            a, b = b, [p + 2 * d * q for p, q in zip(a, rate(th, b, excitation(t + i * d), way))]
        last = [0.5 * (p + q + d * r) for p, q, r in zip(a, b, rate(th, b, excitation(t + h), way))]
        row = [last]
        for k, before in enumerate(table[-1] if table else []):
            ratio = (n / DIVISIONS[len(table) - 1 - k]) ** 2 - 1
            row.append([p + (p - q) / ratio for p, q in zip(row[-1], before)])
        table.append(row)
    return table[-1][-1]


def advance(th, excitation, y, t, end, longest):
    while end - t > 1e-14:
        h = min(longest, end - t)
        way = 1.0 if y[1] > 0 else -1.0
        if abs(y[1]) < 1e-13:  # on a reversal: where it goes from here
            way = 1.0 if rate(th, y, excitation(t), 0.0)[1] > 0 else -1.0
        z = step(th, excitation, y, t, h, way)
        if z[1] * way < 0:
            low, high, at_low, at_high = 0.0, h, y[1], z[1]
            for _ in range(60):
                s = low + (high - low) * min(max(at_low / (at_low - at_high), 0.02), 0.98)
                z = step(th, excitation, y, t, s, way)
                if abs(z[1]) < 1e-14 or high - low < 1e-16:
                    break
                if z[1] * way > 0:
                    low, at_low = s, z[1]
                else:
                    high, at_high = s, z[1]
            z[1], h = 0.0, s
        y, t = z, t + h
    return y


class Plant:
    def __init__(self, theta, frequency, amplitude, steps=240):
        self.th, self.f = theta, frequency
        self.x = lambda t: amplitude * math.cos(2 * math.pi * frequency * t)
        self.longest = 1.0000001 / frequency / steps

    def sampled(self, y, periods):
        out, n = [], SAMPLES * periods
        for j in range(n):
            out.append(y)
            y = advance(self.th, self.x, y, j / SAMPLES / self.f, (j + 1) / SAMPLES / self.f, self.longest)
        return out, y

    def after(self, y, periods):
        for _ in range(periods):
            y = self.sampled(y, 1)[1]
        return y

    def slopes(self, y, periods, h=1e-6):
        columns = []
        for k in range(len(y)):
            up, down = list(y), list(y)
            size = h * (1.0 if k % 2 == 0 else 20.0)
            up[k] += size
            down[k] -= size
            columns.append([(a - b) / (2 * size) for a, b in zip(self.after(up, periods), self.after(down, periods))])
        return [list(row) for row in zip(*columns)]

    def periodic(self, y, periods):
        for _ in range(30):
            m = self.slopes(y, periods)
            gap = [[float(i == k) - m[i][k] for k in range(len(y))] for i in range(len(y))]
            move = solve(gap, [b - a for a, b in zip(y, self.after(y, periods))])
            y = [a + b for a, b in zip(y, move)]
            if max(map(abs, move)) < 1e-13:
                break
        return y, self.slopes(y, periods)


def solve(a, b):
    m = [list(row) + [x] for row, x in zip(a, b)]
    n = len(m)
    for c in range(n):
        p = max(range(c, n), key=lambda r: abs(m[r][c]))
        m[c], m[p] = m[p], m[c]
        for r in range(n):
            if r != c:
                q = m[r][c] / m[c][c]
                m[r] = [x - q * z for x, z in zip(m[r], m[c])]
    return [m[i][n] / m[i][i] for i in range(n)]


def characteristic(m):
    """Coefficients of det(lambda - m), highest first, by Faddeev and Leverrier."""
    n = len(m)
    c, b = [1.0], [[0.0] * n for _ in range(n)]
    for k in range(1, n + 1):
        b = [[sum(m[i][l] * b[l][j] for l in range(n)) + (c[-1] if i == j else 0.0) for j in range(n)]
             for i in range(n)]
        c.append(-sum(m[i][l] * b[l][i] for i in range(n) for l in range(n)) / k)
    return c


def roots(c):
    """Durand and Kerner."""
    n = len(c) - 1
    z = [(0.4 + 0.9j) ** k for k in range(n)]
    for _ in range(2000):
        for i in range(n):
            value = 0.0
            for a in c:
                value = value * z[i] + a
            for j in range(n):
                if j != i:
                    value /= z[i] - z[j]
            z[i] -= value
    return sorted(z, key=lambda r: (-abs(r), -r.imag))


def at_minus_one(m):
    value = 0.0
    for a in characteristic(m):
        value = -value + a
    return value


def response(name, theta, periods, frequency, amplitude, start):
    plant = Plant(theta, frequency, amplitude)
    y, m = plant.periodic(plant.after(start, 150), periods)
    states = plant.sampled(y, periods)[0]
    finer = Plant(theta, frequency, amplitude, 480).sampled(y, periods)
    wrong = max(abs(a - b) for p, q in zip(states, finer[0]) for a, b in zip(p, q))
    one = plant.after(y, 1)
    multipliers = roots(characteristic(m))
    print(f"{name}: {y}, after one period {one}; steps half as long differ by {wrong:.1e}; it closes to "
          f"{max(abs(a - b) for a, b in zip(finer[1], y)):.1e}; multipliers {multipliers}")
    out = dict(theta=theta, periods=periods, frequency=frequency, amplitude=amplitude,
               stroke=[float(f"{s[0]:.12g}") for s in states], velocity=[float(f"{s[1]:.12g}") for s in states],
               multipliers=[[float(f"{r.real:.9g}"), float(f"{r.imag:.9g}")] for r in multipliers])
    if len(y) == 4:
        out["tyre"] = [float(f"{s[2]:.12g}") for s in states]
    turned = fold(theta, frequency, amplitude, y, periods)
    print(f"{name}: turns back at {turned}")
    out["fold"] = turned and float(f"{turned:.10g}")
    return out


def fold(theta, frequency, amplitude, y, periods):
    """The amplitude at which this response, followed downwards, turns back; None when it goes on to a quarter.
    Steps along the tangent of the curve in (state, amplitude / 100), corrected in the plane across it; then the
    bottom of the parabola through three points."""
    n = len(y)

    def gap(w):
        return [u - v for u, v in zip(Plant(theta, frequency, 100 * w[n]).after(w[:n], periods), w)]

    def slopes(w):
        columns = []
        for k in range(n + 1):
            size = 1e-6 * (20.0 if k % 2 == 1 and k < n else 1.0)
            up, down = list(w), list(w)
            up[k] += size
            down[k] -= size
            columns.append([(b - c) / (2 * size) for b, c in zip(gap(up), gap(down))])
        return [list(row) for row in zip(*columns)]

    def correct(guess, along):
        w = list(guess)
        for _ in range(12):
            off = sum((b - c) * d for b, c, d in zip(w, guess, along))
            move = solve(slopes(w) + [along], [-g for g in gap(w)] + [-off])
            w = [b + c for b, c in zip(w, move)]
            if max(map(abs, move)) < 1e-11:
                return w
        return None

    def tangent(w, like):
        t = solve(slopes(w) + [like], [0.0] * n + [1.0])
        length = math.sqrt(sum(x * x for x in t))
        return [x / length for x in t]

    w, length = list(y) + [amplitude / 100], 0.02
    along = tangent(w, [0.0] * n + [-1.0])
    while True:
        new = correct([b + length * c for b, c in zip(w, along)], along)
        turn = tangent(new, along) if new else along
        if not new or sum(b * c for b, c in zip(turn, along)) < 0.97:
            length /= 2
            continue
        if new[n] < amplitude / 400:
            return None
        w, along = new, turn
        if along[n] > 0:
            break
        length *= 1.2
    for h in (length / 2, length / 6, length / 20, length / 20):
        low, high = (correct([b + d * c for b, c in zip(w, along)], along)[n] for d in (-h, h))
        d = h * (low - high) / (2 * (low - 2 * w[n] + high))
        w = correct([b + d * c for b, c in zip(w, along)], along)
        along = tangent(w, along)
    return 100 * w[n]


def doubling(theta, frequency, between):
    y = [(1 - theta[1] / G) / theta[2], 0.0] + ([G * (1 + RATIO) / theta[4], 0.0] if len(theta) > 4 else [])

    def test(amplitude):
        nonlocal y
        y, m = Plant(theta, frequency, amplitude).periodic(y, 1)
        return at_minus_one(m)

    low, high = between
    y = Plant(theta, frequency, low).after(y, 60)
    at_low, at_high, side = test(low), test(high), 0
    assert at_low * at_high < 0, (at_low, at_high)
    for _ in range(40):  # Illinois
        a = (low * at_high - high * at_low) / (at_high - at_low)
        value = test(a)
        if abs(value) < 1e-9 or high - low < 1e-9:
            break
        if value * at_low > 0:
            low, at_low, at_high = a, value, at_high * (0.5 if side == 1 else 1.0)
            side = 1
        else:
            high, at_high, at_low = a, value, at_low * (0.5 if side == -1 else 1.0)
            side = -1
    print(f"doubling at {frequency} Hz: {a:.10f}, det(M + 1) = {value:.1e}")
    return dict(theta=theta, frequency=frequency, amplitude=float(f"{a:.10g}"))


if __name__ == "__main__":
    out = {name: response(name, **case) for name, case in CASES.items()}
    out["doublings"] = {name: doubling(**case) for name, case in DOUBLINGS.items()}
    lines = []
    for name, value in out.items():
        inner = ",\n  ".join(f"{json.dumps(k)}: {json.dumps(v)}" for k, v in value.items())
        lines.append(f"{json.dumps(name)}: {{\n  {inner}\n}}")
    (HERE / "reference.json").write_text("{" + ",\n".join(lines) + "}\n")
