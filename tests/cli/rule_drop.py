"""Drops by rule with formulas and an integrator of their own: numbers that owe nothing to the estimator.
Heights in inches as the rules print them; motion by Runge and Kutta in SI. Standard library alone."""
import math

INCH, FOOT, POUND, G = 0.0254, 0.3048, 4.4482216152605, 9.80665
STEP, DURATION = 2e-4, 0.8


def height(rule, condition, pounds_per_square_foot=None, speed=None):
    """Of the free drop, m."""
    if rule == "25.723":
        feet = {"design": 10, "take-off": 6, "reserve": 12}[condition]
        return (feet * FOOT) ** 2 / (2 * G)
    if rule == "23.725":
        inches = min(max(3.6 * math.sqrt(pounds_per_square_foot), 9.2), 18.7)
        return inches * INCH * (1.44 if condition == "reserve" else 1)
    if rule == "27.725":
        inches = 13 if speed is None else min(13, max(8, speed ** 2 / (2 * G) / INCH))
    else:
        inches = 8 if speed is None else max(8, speed ** 2 / (2 * G) / INCH)
    return inches * INCH * (1.5 if condition == "reserve" else 1)


class Gear:
    """An oleo, its forces in N, with or without a tyre: unsprung mass, stiffness, damping."""

    def __init__(self, theta, shaker_mass, tyre=None):
        self.theta, self.mass, self.tyre = theta, shaker_mass, tyre

    def strut(self, stroke, rate):
        t1, t2, t3, t4 = self.theta
        return self.mass * (t1 * abs(rate) * rate + t2 * (1 - t3 * stroke) ** -t4)

    def rates(self, s, sprung, lift):
        """Of (descent, its rate, deflection of the tyre, its rate)."""
        z, w, y, q = s
        force = self.strut(z - y, w - q)
        down = G - (force + lift) / sprung
        if not self.tyre:
            return w, down, 0.0, 0.0
        unsprung, stiffness, damping = self.tyre
        return w, down, q, G + (force - stiffness * y - damping * q) / unsprung

    def step(self, s, h, sprung, lift):
        def moved(k, share):
            return tuple(a + share * h * b for a, b in zip(s, k))
        k1 = self.rates(s, sprung, lift)
        k2 = self.rates(moved(k1, 0.5), sprung, lift)
        k3 = self.rates(moved(k2, 0.5), sprung, lift)
        k4 = self.rates(moved(k3, 1.0), sprung, lift)
        return tuple(a + h / 6 * (b + 2 * c + 2 * d + e) for a, b, c, d, e in zip(s, k1, k2, k3, k4))

    def drop(self, weight, speed, lift_force):
        """The greatest descent of the mass in a drop, the largest force of the strut, the mass above it."""
        sprung = weight / G - (self.tyre[0] if self.tyre else 0.0)
        states = [(0.0, speed, 0.0, speed if self.tyre else 0.0)]
        for _ in range(round(DURATION / STEP)):
            states.append(self.step(states[-1], STEP, sprung, lift_force))
        turns = [i for i in range(len(states) - 1) if states[i][1] > 0 >= states[i + 1][1]]
        last = max(turns, key=lambda i: states[i][0])
        low, high = 0.0, STEP
        for _ in range(60):
            middle = 0.5 * (low + high)
            if self.step(states[last], middle, sprung, lift_force)[1] > 0:
                low = middle
            else:
                high = middle
        descent = self.step(states[last], low, sprung, lift_force)[0]

        def force(s):
            return self.strut(s[0] - s[2], s[1] - s[3])
        forces = [force(s) for s in states]
        top = max(range(len(forces)), key=forces.__getitem__)
        if top == 0:
            return descent, forces[0], sprung
        low, high = 0.0, 2 * STEP
        for _ in range(80):  # thirds
            a, b = low + (high - low) / 3, high - (high - low) / 3
            if force(self.step(states[top - 1], a, sprung, lift_force)) < \
                    force(self.step(states[top - 1], b, sprung, lift_force)):
                low = a
            else:
                high = b
        return descent, force(self.step(states[top - 1], low, sprung, lift_force)), sprung


def by_rule(gear, rule, condition, weight, lift, **more):
    """h, W_e, d and n."""
    h = height(rule, condition, **more)
    speed = math.sqrt(2 * G * h)
    if rule == "25.723":
        d, force, sprung = gear.drop(weight, speed, lift * weight)
        return h, weight, d, (force + lift * weight) / sprung / G

    def effective(d):
        return weight * (h + (1 - lift) * d) / (h + d)
    low, high = 0.0, gear.drop(weight, speed, 0.0)[0]
    # The descent falls with d, for a larger d is a lighter drop: false position.
    f_low = gear.drop(effective(low), speed, 0.0)[0] - low
    f_high = gear.drop(effective(high), speed, 0.0)[0] - high
    d = high
    for _ in range(40):
        d = high - f_high * (high - low) / (f_high - f_low)
        miss = gear.drop(effective(d), speed, 0.0)[0] - d
        if abs(miss) < 1e-10:
            break
        if (miss > 0) == (f_low > 0):
            low, f_low = d, miss
            f_high *= 0.5
        else:
            high, f_high = d, miss
            f_low *= 0.5
    _, force, sprung = gear.drop(effective(d), speed, 0.0)
    return h, effective(d), d, force / sprung / G * effective(d) / weight + lift
