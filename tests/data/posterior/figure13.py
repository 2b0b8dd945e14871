#!/usr/bin/python3
"""Figure 13 (model (6.3), 5 ft/s^2, 2 Hz) with 1 % noise, and the posterior of all four parameters by
quadrature: Runge-Kutta steps and shooting, an equally spaced rule along theta4 (in its logarithm, between
its bounds) and a lattice over the other three around their best values there, one for each marginal. The
noise's variance is integrated out under 1 / sigma, so the density is SS^(-40 / 2). Plain Python. Writes
figure13.csv, the record, and figure13_reference.csv beside itself: a row a parameter with mean, standard
deviation, the 2.5, 50 and 97.5 % quantiles and the marginal density at these. Takes some minutes."""
import itertools
import math
import pathlib
import random
import sys

HERE = pathlib.Path(__file__).resolve().parent
GRAVITY, AMPLITUDE, FREQUENCY = 32.178, 5.0, 2.0
POINTS = 40
TRUTH = [5.08, 5.0, 1.62, 1.0]
LOWER, UPPER = 0.1, 5.0  # of theta4
ALONG = 0.04  # step of ln theta4
ACROSS, RADIUS = 1.2, 5.2  # of the lattice, standard deviations
FINE = 12  # points of a marginal to one of the lattice


def tables(steps):
    return [AMPLITUDE * math.cos(math.pi * i / steps) + GRAVITY for i in range(2 * steps + 1)]


def period(theta, x, state):
    """The end of one period and the displacement at its 40 points; None where the gas has no room."""
    t1, t2, t3, t4 = theta
    steps = (len(x) - 1) // 2
    h = 1 / FREQUENCY / steps
    u, v = state
    out = []
    every = steps // POINTS
    try:
        for i in range(steps):
            if i % every == 0:
                out.append(u)
            a, b, c = x[2 * i], x[2 * i + 1], x[2 * i + 2]
            k1 = a - t1 * abs(v) * v - t2 * (1 - t3 * u) ** -t4
            v2 = v + 0.5 * h * k1
            k2 = b - t1 * abs(v2) * v2 - t2 * (1 - t3 * (u + 0.5 * h * v)) ** -t4
            v3 = v + 0.5 * h * k2
            k3 = b - t1 * abs(v3) * v3 - t2 * (1 - t3 * (u + 0.5 * h * v2)) ** -t4
            v4 = v + h * k3
            k4 = c - t1 * abs(v4) * v4 - t2 * (1 - t3 * (u + h * v3)) ** -t4
            u += h / 6 * (v + 2 * v2 + 2 * v3 + v4)
            v += h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
            if isinstance(u, complex) or not abs(u) < 1e3:
                return None
    except (OverflowError, ZeroDivisionError, TypeError):
        return None
    return u, v, out


def slope(theta, x, state):
    """Inverse of 1 - d(end)/d(state)."""
    e = 1e-6
    mid = period(theta, x, state)
    du, dv = period(theta, x, (state[0] + e, state[1])), period(theta, x, (state[0], state[1] + e))
    if None in (mid, du, dv):
        return None
    a, b = 1 - (du[0] - mid[0]) / e, -(dv[0] - mid[0]) / e
    c, d = -(du[1] - mid[1]) / e, 1 - (dv[1] - mid[1]) / e
    det = a * d - b * c
    return d / det, -b / det, -c / det, a / det


def response(theta, x, state, inverse):
    """Shooting with the slope given; state and displacement, or None."""
    u, v = state
    for _ in range(40):
        end = period(theta, x, (u, v))
        if end is None:
            return None
        du, dv = end[0] - u, end[1] - v
        if max(abs(du), abs(dv)) < 1e-11:
            return (u, v), end[2]
        u += inverse[0] * du + inverse[1] * dv
        v += inverse[2] * du + inverse[3] * dv
    return None


def solve(a, b):
    n = len(a)
    m = [list(a[i]) + [b[i]] for i in range(n)]
    for c in range(n):
        p = max(range(c, n), key=lambda r: abs(m[r][c]))
        m[c], m[p] = m[p], m[c]
        for r in range(n):
            if r != c:
                q = m[r][c] / m[c][c]
                m[r] = [y - q * z for y, z in zip(m[r], m[c])]
    return [m[i][n] / m[i][i] for i in range(n)]


def squares(y, u):
    return sum((a - b) ** 2 for a, b in zip(y, u))


def ridge(y, theta, x, state):
    """Best theta1 to theta3 of the last one by Gauss-Newton; theta, state, slopes, J^T J, SS."""
    theta = list(theta)
    for _ in range(60):
        inverse = slope(theta, x, state)
        found = inverse and response(theta, x, state, inverse)
        if not found:
            return None
        state, u = found
        columns, moves = [], []
        for k in range(3):
            h = 1e-5 * theta[k]
            beside = theta[:]
            beside[k] += h
            other = response(beside, x, state, inverse)
            columns.append([(b - a) / h for a, b in zip(u, other[1])])
            moves.append([(b - a) / h for a, b in zip(state, other[0])])
        jtj = [[sum(a * b for a, b in zip(columns[k], columns[l])) for l in range(3)] for k in range(3)]
        jte = [sum(a * (m - p) for a, m, p in zip(columns[k], y, u)) for k in range(3)]
        step = solve(jtj, jte)
        now = squares(y, u)
        if sum(s * t for s, t in zip(step, jte)) < 1e-7 * now:
            return theta, state, inverse, moves, jtj, now
        part = 1.0
        while part > 1e-4:  # downhill
            new = [t + part * s for t, s in zip(theta, step)] + [theta[3]]
            to = tuple(s + part * sum(m[i] * d for m, d in zip(moves, step)) for i, s in enumerate(state))
            other = response(new, x, to, inverse)
            if other and squares(y, other[1]) <= now * (1 + 1e-9):
                theta, state = new, other[0]
                break
            part *= 0.5
        else:
            return None
    return None


def root(a):
    """Lower L with L L^T = a, three by three."""
    out = [[0.0] * 3 for _ in range(3)]
    for i in range(3):
        for j in range(i + 1):
            s = a[i][j] - sum(out[i][k] * out[j][k] for k in range(j))
            out[i][j] = math.sqrt(s) if i == j else s / out[j][j]
    return out


def lattice():
    """Equally spaced points in a ball, by their first coordinate."""
    most = int(RADIUS / ACROSS)
    for first in range(-most, most + 1):
        yield first, [(first * ACROSS, ACROSS * i, ACROSS * j)
                      for i, j in itertools.product(range(-most, most + 1), repeat=2)
                      if first * first + i * i + j * j <= (RADIUS / ACROSS) ** 2]


def record():
    x = tables(2000)
    state, inverse = (0.5, 0.0), None
    for _ in range(20):
        state = period(TRUTH, x, state)[:2]
    inverse = slope(TRUTH, x, state)
    u = response(TRUTH, x, state, inverse)[1]
    noise = random.Random(13)
    half = 0.01 * max(abs(a) for a in u)
    return [a + noise.uniform(-half, half) for a in u], state


def slices(y, x, theta, state, inverse, moves, covariance, k, log_weight):
    """theta_k on a fine grid with ln of the density of all others there, integrated."""
    order = [k] + [i for i in range(3) if i != k]
    l = root([[covariance[i][j] for j in order] for i in order])
    volume = math.log(l[0][0] * l[1][1] * l[2][2]) + log_weight
    coarse = []
    for first, points in lattice():
        logs = []
        for z in points:
            d = [0.0] * 3
            for i, row in zip(order, l):
                d[i] = sum(a * b for a, b in zip(row, z))
            here = [t + e for t, e in zip(theta, d)] + [theta[3]]
            # The damping ends at 0; its own marginal is cut there below.
            if min(here[1:] if k == 0 else here) <= 0:
                continue
            to = tuple(s + sum(m[c] * e for m, e in zip(moves, d)) for c, s in enumerate(state))
            u = response(here, x, to, inverse)
            if u is not None:
                logs.append(-0.5 * POINTS * math.log(squares(y, u[1])))
        if logs:
            top = max(logs)
            coarse.append((first, volume + top + math.log(sum(math.exp(g - top) for g in logs))))
    first, logs = coarse[0][0], [log for _, log in coarse]
    assert len(logs) == coarse[-1][0] - first + 1 and len(logs) >= 6
    fine = []
    for i in range(FINE * (len(logs) - 1) + 1):  # through six neighbours
        at = i / FINE
        left = min(max(int(at) - 2, 0), len(logs) - 6)
        log = 0.0
        for m in range(6):
            w = 1.0
            for n in range(6):
                if n != m:
                    w *= (at - left - n) / (m - n)
            log += w * logs[left + m]
        value = theta[k] + l[0][0] * ACROSS * (first + at)
        if value > 0:
            fine.append((value, log - math.log(FINE)))
    return fine


def nodes(y, state):
    """For each parameter its values with ln of what belongs to them."""
    x = tables(80)
    count = round(math.log(UPPER / LOWER) / ALONG)
    step = math.log(UPPER / LOWER) / count
    first = round(math.log(TRUTH[3] / LOWER) / step)
    out, most = [[], [], [], []], -math.inf
    for way in (range(first, count + 1), range(first - 1, -1, -1)):
        at, before = (TRUTH, state), None
        for i in way:
            theta4 = LOWER * math.exp(step * i)
            guess = [t if before is None else 2 * t - b for t, b in zip(at[0][:3], (before or at)[0][:3])]
            found = ridge(y, guess + [theta4], x, at[1]) or ridge(y, at[0][:3] + [theta4], x, at[1])
            if not found:
                print("no ridge at theta4 =", theta4, file=sys.stderr)
                break
            theta, state_here, inverse, moves, jtj, ss = found
            before, at = at, (theta, state_here)
            unit = [[float(i == j) for j in range(3)] for i in range(3)]
            covariance = [[ss / (POINTS - 3) * c for c in solve(jtj, e)] for e in unit]
            log_weight = math.log(theta4 * (0.5 if i in (0, count) else 1.0))
            parts = [slices(y, x, theta, state_here, inverse, moves, covariance, k, log_weight) for k in range(3)]
            wholes = [log_sum([log for _, log in part]) for part in parts]
            print(f"theta4 {theta4:.4f}, the best others {theta[0]:.4f} {theta[1]:.4f} {theta[2]:.4f}, SS {ss:.6e}, "
                  f"ln mass {wholes[0]:.6f} {wholes[1]:.6f} {wholes[2]:.6f}", file=sys.stderr)
            for k in range(3):
                out[k] += parts[k]
            out[3].append((theta4, wholes[0]))
            most = max(most, wholes[0])
            if wholes[0] < most - 18:
                break
    return out


def log_sum(logs):
    top = max(logs)
    return top + math.log(sum(math.exp(log - top) for log in logs))


def spread(pairs):
    """Values in order with their probability."""
    whole = log_sum([log for _, log in pairs])
    return sorted((value, math.exp(log - whole)) for value, log in pairs)


def share_below(pairs, at):
    """The distribution, linear between the nodes' middles."""
    below, previous, half = 0.0, pairs[0][0], 0.0
    for value, w in pairs:
        middle = below + 0.5 * w
        if value >= at:
            return half + (at - previous) / (value - previous) * (middle - half) if value > previous else half
        below += w
        previous, half = value, middle
    return 1.0


def quantile(pairs, p):
    low, high = pairs[0][0], pairs[-1][0]
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if share_below(pairs, middle) < p else (low, middle)
    return low


def main():
    y, state = record()
    (HERE / "figure13.csv").write_text("displacement\n" + "".join(f"{u!r}\n" for u in y))
    rows = ["mean,standard_deviation,q025,q500,q975,density025,density500,density975"]
    for values in nodes(y, state):
        pairs = spread(values)
        mean = sum(w * t for t, w in pairs)
        deviation = math.sqrt(sum(w * (t - mean) ** 2 for t, w in pairs))
        quantiles = [quantile(pairs, p) for p in (0.025, 0.5, 0.975)]
        near = 0.15 * deviation
        density = [(share_below(pairs, q + near) - share_below(pairs, q - near)) / (2 * near) for q in quantiles]
        rows.append(",".join(f"{v:.8g}" for v in [mean, deviation] + quantiles + density))
    (HERE / "figure13_reference.csv").write_text("\n".join(rows) + "\n")


if __name__ == "__main__":
    main()
