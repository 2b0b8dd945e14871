"""The linear oscillator (6.2), y'' + c y' + k y = x, in closed form, and least squares by hand: numbers that
owe nothing to the estimator. Standard library alone."""
import cmath
import math

FREQUENCY = 2.0
MODEL = {"name": "linear", "gravity": 0, "length_unit": "m", "effects": [
    {"effect": "viscous_damping", "parameters": {"c": {"start": 2.2, "lower": 0}}},
    {"effect": "linear_stiffness", "parameters": {"k": {"start": 115, "lower": 0}}}]}


def transfer(c, k, h):
    """Displacement over excitation at harmonic h, its derivatives over c and k, and i omega."""
    s = 2j * math.pi * FREQUENCY * h
    g = 1 / (k + s * s + s * c)
    return g, -s * g * g, -g * g, s


def channels(c, k, h):
    """Of displacement and acceleration of the mass in space (c v + k u): transfer, d/dc, d/dk."""
    g, gc, gk, s = transfer(c, k, h)
    return ((g, gc, gk), ((s * c + k) * g, s * g + (s * c + k) * gc, g + (s * c + k) * gk))


def wave(value, h, tau):
    return (value * cmath.exp(2j * math.pi * h * tau)).real


def product(a, b):
    return [[sum(x * y for x, y in zip(row, column)) for column in zip(*b)] for row in a]


def transposed(a):
    return [list(column) for column in zip(*a)]


def inverse(a):
    """Gauss-Jordan with pivots."""
    n = len(a)
    rows = [list(map(float, row)) + [float(i == j) for j in range(n)] for i, row in enumerate(a)]
    for i in range(n):
        best = max(range(i, n), key=lambda r: abs(rows[r][i]))
        rows[i], rows[best] = rows[best], rows[i]
        rows[i] = [x / rows[i][i] for x in rows[i]]
        for r in range(n):
            if r != i:
                rows[r] = [x - rows[r][i] * y for x, y in zip(rows[r], rows[i])]
    return [row[n:] for row in rows]


def channel_covariance(c, k, amplitude, points, deviations, excitation_error):
    """Of theta by (3.15): displacement and acceleration at `points` equal steps with the standard deviations
    of one point's mean, and an error in each cosine and sine part of the excitation's harmonics 1 to 3."""
    rows, moves = [], []
    for i in range(points):
        for b, sigma in enumerate(deviations):
            _, over_c, over_k = channels(c, k, 1)[b]
            rows.append([amplitude * wave(g, 1, i / points) / sigma for g in (over_c, over_k)])
            moves.append([wave(part * channels(c, k, h)[b][0], h, i / points) / sigma
                          for h in (1, 2, 3) for part in (1, -1j)])
    covariance = inverse(product(transposed(rows), rows))
    shift = product(covariance, product(transposed(rows), moves))
    return [[covariance[p][q] + excitation_error ** 2 * sum(x * y for x, y in zip(shift[p], shift[q]))
             for q in range(2)] for p in range(2)]


def fourier(samples, count):
    """Mean, cos 1, sin 1, cos 2, ..."""
    n = len(samples)
    out = [sum(samples) / n]
    for j in range(1, count):
        turn = 2 * math.pi * ((j + 1) // 2) / n
        part = math.cos if j % 2 else math.sin
        out.append(2 / n * sum(y * part(turn * i) for i, y in enumerate(samples)))
    return out


def fit_harmonics(cycles, amplitude, count):
    """theta and standard errors of the oscillator by generalised least squares on the mean cycle's Fourier
    coefficients, weighed by the cycles' own scatter; errors as Rao (1965) has them."""
    each = [fourier(cycle, count) for cycle in cycles]
    n = len(cycles)
    mean = [sum(column) / n for column in zip(*each)]
    off = [[x - m for x, m in zip(row, mean)] for row in each]
    weight = inverse([[x / (n * (n - 1)) for x in row] for row in product(transposed(off), off)])
    c, k = 2.0, 120.0
    for _ in range(30):
        g, gc, gk, _ = transfer(c, k, 1)
        # amplitude * Re(G e^(i phi)) = Re G cos phi - Im G sin phi
        left = [[m] for m in mean]
        left[1][0] -= amplitude * g.real
        left[2][0] += amplitude * g.imag
        rows = [[0.0, 0.0] for _ in mean]
        rows[1] = [amplitude * gc.real, amplitude * gk.real]
        rows[2] = [-amplitude * gc.imag, -amplitude * gk.imag]
        weighed = product(transposed(rows), weight)
        covariance = inverse(product(weighed, rows))
        step = product(covariance, product(weighed, left))
        c, k = c + step[0][0], k + step[1][0]
    t2 = product(product(transposed(left), weight), left)[0][0]
    nu = n - 1
    factor = nu / (nu - count + 2) * (1 + t2 / nu)
    return (c, k), [math.sqrt(factor * covariance[p][p]) for p in range(2)]
