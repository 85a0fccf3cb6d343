"""How good a recording's truth is, judged by its own inertial samples and by itself; no estimate is in it.

Positions, orientations and velocities of a rigid body hang together: the change of orientation is the gyroscope's, the second
difference of the positions that of the accelerometer integrated twice, the difference of positions the mean of the velocities. Where a
truth breaks this, an estimate is told an error that is the truth's.
"""

import bisect
import math

from real.layout import BadInput, matrix, multiply, read_lines, read_numbers, rotate, transpose, turned

WINDOW = 0.3  # [s] of the second difference: noise of the accelerometer does not count yet, that of positions does
STEP = 0.05  # [s] from one second difference to the next
LARGEST_DELAY = 0.04  # [s]
SPAN = 1.0  # [s] over which turns and velocities are compared
LONGEST_GAP = 0.05  # [s] in the truth that is bridged


def unit(q):
    return [x / math.hypot(*q) for x in q]


def vector_of(R):
    """Rotation vector, below half a turn."""
    c = max(-1.0, min(1.0, (R[0][0] + R[1][1] + R[2][2] - 1) / 2))
    angle = math.acos(c)
    scale = 0.5 if angle < 1e-6 else angle / (2 * math.sin(angle))
    return [scale * (R[2][1] - R[1][2]), scale * (R[0][2] - R[2][0]), scale * (R[1][0] - R[0][1])]


class Series:
    """Vectors over time [s], between which is interpolated; nothing where the gap is too long."""

    def __init__(self, t, values, longest_gap=math.inf):
        self.t, self.values, self.longest_gap = t, values, longest_gap

    def at(self, t):
        k = bisect.bisect_left(self.t, t)
        if k == 0 or k == len(self.t) or self.t[k] - self.t[k - 1] > self.longest_gap:
            return None
        part = (t - self.t[k - 1]) / (self.t[k] - self.t[k - 1])
        return [a + part * (b - a) for a, b in zip(self.values[k - 1], self.values[k])]

    def second_difference(self, t):
        ends = [self.at(t - WINDOW), self.at(t), self.at(t + WINDOW)]
        return None if None in ends else [a - 2 * b + c for a, b, c in zip(*ends)]


def integrated(t, values):
    """Trapezoids, from zero."""
    total, result = [0.0] * len(values[0]), []
    for k, value in enumerate(values):
        if k:
            total = [s + (a + b) / 2 * (t[k] - t[k - 1]) for s, a, b in zip(total, values[k - 1], value)]
        result.append(total)
    return result


def solve(A, b):
    """A x = b, A symmetric and positive."""
    n = len(b)
    rows = [[*row, value] for row, value in zip(A, b)]
    for i in range(n):
        for k in range(i + 1, n):
            factor = rows[k][i] / rows[i][i]
            rows[k] = [a - factor * c for a, c in zip(rows[k], rows[i])]
    x = [0.0] * n
    for i in reversed(range(n)):
        x[i] = (rows[i][n] - sum(rows[i][k] * x[k] for k in range(i + 1, n))) / rows[i][i]
    return x


class Truth:
    """`rows` and `imu`: (time [ns], numbers) of state_groundtruth_estimate0 and imu0."""

    def __init__(self, rows, imu):
        zero = rows[0][0]
        self.t = [1e-9 * (t - zero) for t, _ in rows]
        self.R = [matrix(*unit(values[3:7])) for _, values in rows]
        self.p = Series(self.t, [values[:3] for _, values in rows], LONGEST_GAP)
        has_velocity = len(rows[0][1]) >= 10 and any(any(values[7:10]) for _, values in rows)
        self.v = Series(self.t, integrated(self.t, [values[7:10] for _, values in rows])) if has_velocity else None
        self.imu_t = [1e-9 * (t - zero) for t, _ in imu]
        self.gyro = [values[:3] for _, values in imu]
        self.accel = [values[3:6] for _, values in imu]

    def R_at(self, t):
        k = min(max(bisect.bisect_left(self.t, t), 1), len(self.t) - 1)
        return self.R[k] if self.t[k] - t < t - self.t[k - 1] else self.R[k - 1]

    def gyro_at(self, t, k):
        """Between samples k - 1 and k."""
        part = (t - self.imu_t[k - 1]) / (self.imu_t[k] - self.imu_t[k - 1]) if k else 1.0
        return [a + part * (b - a) for a, b in zip(self.gyro[k - 1], self.gyro[k])]

    def turns(self, bias):
        """Rotation vectors [rad] by which turns over SPAN differ from the gyroscope's less `bias`, over SPAN."""
        differences, t = [], max(self.t[0], self.imu_t[0])
        while t + SPAN < min(self.t[-1], self.imu_t[-1]):
            i, j = bisect.bisect_left(self.t, t), bisect.bisect_left(self.t, t + SPAN)
            now, end = self.t[i], self.t[j]
            span = end - now
            k = bisect.bisect_left(self.imu_t, now)
            R = matrix(1.0, 0.0, 0.0, 0.0)
            while k < len(self.imu_t) and now < end:
                until = min(self.imu_t[k], end)
                middle = self.gyro_at((now + until) / 2, k)
                R = turned(R, [(w - b) * (until - now) for w, b in zip(middle, bias)])
                now, k = until, k + 1
            if span < 2 * SPAN:
                difference = vector_of(multiply(transpose(R), multiply(transpose(self.R[i]), self.R[j])))
                differences.append([SPAN / span * a for a in difference])
            t += SPAN / 2
        return differences

    def turn_scatter(self):
        """[rad] by how much turns over SPAN differ from the gyroscope's, in the mean; its bias is the median."""
        bias = [0.0, 0.0, 0.0]
        for _ in range(3):
            differences = self.turns(bias)
            if not differences:
                return None
            bias = [b - sorted(column)[len(column) // 2] / SPAN for b, column in zip(bias, zip(*differences))]
        return math.sqrt(sum(a * a for d in differences for a in d) / len(differences))

    def velocity_scatter(self):
        """[m/s] by how much the mean velocity over SPAN is not what the positions moved, at its worst; None: no velocities."""
        if self.v is None:
            return None
        worst, t = 0.0, self.t[0]
        while t + SPAN < self.t[-1]:
            i, j = bisect.bisect_left(self.t, t), bisect.bisect_left(self.t, t + SPAN)
            moved = [b - a for a, b in zip(self.p.values[i], self.p.values[j])]
            said = [b - a for a, b in zip(self.v.values[i], self.v.values[j])]
            worst = max(worst, math.dist(moved, said) / (self.t[j] - self.t[i]))
            t += SPAN / 4
        return worst

    def delay(self):
        """(seconds that the positions lag behind the inertial samples, position scatter [m] at that delay): the accelerometer integrated
        twice, with the lever to the positions, gravity and bias fitted. None: too few positions without gaps."""
        inside = [k for k, t in enumerate(self.imu_t) if self.t[0] <= t <= self.t[-1]]
        if len(inside) < 10:
            return None
        t = [self.imu_t[k] for k in inside]
        a_W = [rotate(self.R_at(self.imu_t[k]), self.accel[k]) for k in inside]
        moved = Series(t, integrated(t, integrated(t, a_W)))
        axes = [Series(self.t, [[row[j] for row in R] for R in self.R]) for j in range(3)]
        samples = []
        at = t[0] + WINDOW + 2 * LARGEST_DELAY
        while at < t[-1] - WINDOW - 2 * LARGEST_DELAY:
            seen = self.p.second_difference(at)
            levers = [axis.second_difference(at) for axis in axes]
            if seen is not None and None not in levers:
                R = self.R_at(at)
                samples.append((at, seen, [[-levers[j][i] for j in range(3)] + [1.0 if j == i else 0.0 for j in range(3)] +
                                           [R[i][j] * WINDOW ** 2 for j in range(3)] for i in range(3)]))
            at += STEP
        if len(samples) < 30:
            return None

        size = 9
        A = [[1e-6 * (i == j) + sum(row[i] * row[j] for _, _, rows in samples for row in rows) for j in range(size)] for i in range(size)]

        def scatter(delay):
            b, squares = [0.0] * size, 0.0
            for at, seen, rows in samples:
                for row, m, s in zip(rows, moved.second_difference(at - delay), seen):
                    squares += (m - s) ** 2
                    b = [total + r * (m - s) for total, r in zip(b, row)]
            rest = squares - sum(a * c for a, c in zip(solve(A, b), b))
            return math.sqrt(max(rest, 0.0) / (3 * len(samples)) / 6.0)  # second difference: 1 + 4 + 1 variances

        steps = [1e-3 * k for k in range(-int(1e3 * LARGEST_DELAY), int(1e3 * LARGEST_DELAY) + 1, 4)]
        coarse = min(steps, key=scatter)
        least, best = min((scatter(delay), delay) for delay in (coarse + 1e-3 * k for k in range(-3, 4)))
        return best, least


POSE = ["timestamp", "p_x", "p_y", "p_z", "q_w", "q_x", "q_y", "q_z"]
IMU = ["timestamp", "w_x", "w_y", "w_z", "a_x", "a_y", "a_z"]


def judge(recording):
    """What the page shows of the recording in this folder; nothing where its truth has no orientations."""
    path = recording / "mav0/state_groundtruth_estimate0/data.csv"
    if not path.exists():
        return None
    row = next((line for line in read_lines(path) if line.strip() and not line.startswith("#")), "")
    more = row.count(",") + 1 - len(POSE)
    if more < 0:
        raise BadInput(f"{path}: {', '.join(POSE)} expected")
    truth = Truth(read_numbers(path, POSE + ["v_x", "v_y", "v_z", *(f"column {k}" for k in range(12, more + 9))][:more]),
                  read_numbers(recording / "mav0/imu0/data.csv", IMU))
    delay = truth.delay()
    return {"turn_scatter_rad": truth.turn_scatter(), "worst_velocity_m_s": truth.velocity_scatter(),
            "delay_s": delay and delay[0], "position_scatter_m": delay and delay[1]}


def table(judged):
    """Markdown; (name, figures) of each recording."""
    lines = ["| recording | turn over 1 s against the gyroscope [mrad] | positions against its own velocities, worst second [m/s] | "
             "positions late by [ms] | positions scatter by [mm] |", "|---|---|---|---|---|"]
    for name, f in judged:
        cells = [(f["turn_scatter_rad"], 1e3, 1), (f["worst_velocity_m_s"], 1, 3), (f["delay_s"], 1e3, 0), (f["position_scatter_m"], 1e3, 1)]
        lines.append(f"| {name} | " + " | ".join("-" if v is None else f"{k * v:.{d}f}" for v, k, d in cells) + " |")
    return "\n".join(lines)
