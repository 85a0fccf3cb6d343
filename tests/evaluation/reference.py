"""An evaluation written from the definitions in docs/evaluation.md alone, with numpy. It shares no code with the program.

reference.py ESTIMATE.csv TRUTH.csv EXTRA.csv prints the figures of every alignment as JSON, under the names that
`ear evaluate --json` uses. ESTIMATE is a states.csv, TRUTH an EuRoC csv, EXTRA a truth_extra.csv; all are taken as
well-formed.
"""

import bisect
import json
import sys

import numpy as np

CHI2_3_LOW, CHI2_3_HIGH = 0.21579528262389788, 9.348403604496148
ERRORS = ["x", "y", "z", "rx", "ry", "rz"]


def read(path):
    with open(path, encoding="utf-8") as file:
        names = file.readline().lstrip("#").strip().split(",")
        rows = [line.strip().split(",") for line in file]
    return {name: [row[i] for row in rows] for i, name in enumerate(names)}


def numbers(table, names):
    return np.array([[float(x) for x in table[name]] for name in names]).T


def matrix(q):
    """Rotation matrices of quaternions w x y z, one per row."""
    w, x, y, z = (q / np.linalg.norm(q, axis=1, keepdims=True)).T
    return np.stack([np.stack([1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)], -1),
                     np.stack([2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)], -1),
                     np.stack([2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)], -1)], -2)


def log(R):
    """Rotation vector; its length from both the antisymmetric part and the trace, good below pi."""
    v = 0.5 * np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
    sine, cosine = np.linalg.norm(v), 0.5 * (np.trace(R) - 1)
    return v if sine < 1e-12 else v / sine * np.arctan2(sine, cosine)


def exp(w):
    angle = np.linalg.norm(w)
    if angle < 1e-12:
        return np.eye(3)
    K = np.array([[0, -w[2], w[1]], [w[2], 0, -w[0]], [-w[1], w[0], 0]]) / angle
    return np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * K @ K


def about_z(yaw):
    return exp(np.array([0, 0, yaw]))


def gap_limit(t):
    intervals = sorted(int(b) - int(a) for a, b in zip(t, t[1:]))
    return max(100_000_000, 3 * intervals[len(intervals) // 2])


def gaps(t):
    """Intervals between stamps that are longer than the limit."""
    limit = gap_limit(t)
    return [(a, b) for a, b in zip(t, t[1:]) if b - a > limit]


def associate(t_est, t, p, R):
    """Rows (index, truth position, truth rotation, segment), and how many poses are outside or in gaps."""
    truth_gaps, estimate_gaps = gaps(t), gaps(t_est)
    matches, outside, in_gaps = [], 0, 0
    for i, time in enumerate(t_est):
        if time < t[0] or time > t[-1]:
            outside += 1
            continue
        if any(a < time < b for a, b in truth_gaps):
            in_gaps += 1
            continue
        segment = (sum(b <= time for _, b in truth_gaps), sum(b <= time for _, b in estimate_gaps))
        b = bisect.bisect_left(t, time)
        if t[b] == time:
            position, rotation = p[b], R[b]
        else:
            u = (time - t[b - 1]) / (t[b] - t[b - 1])
            position = (1 - u) * p[b - 1] + u * p[b]
            rotation = R[b - 1] @ exp(u * log(R[b - 1].T @ R[b]))
        matches.append((i, position, rotation, segment))
    return matches, outside, in_gaps


def travelled(t, p, times, positions):
    """Steps of at least 0.1 m along the truth, and from the last step straight to the position; never decreasing."""
    steps = [(t[0], 0.0, p[0])]
    for time, position in zip(t, p):
        step = np.linalg.norm(position - steps[-1][2])
        if step >= 0.1:
            steps.append((time, steps[-1][1] + step, position))
    stamps = [step[0] for step in steps]
    result = []
    for time, position in zip(times, positions):
        _, length, anchor = steps[bisect.bisect_right(stamps, time) - 1]
        result.append(length + np.linalg.norm(position - anchor))
    return np.maximum.accumulate(result)


def attitude_rotation(kind, R_true, R_est):
    M = sum(a @ b.T for a, b in zip(R_true, R_est))
    if kind != "se3":
        return about_z(np.arctan2(M[1, 0] - M[0, 1], M[0, 0] + M[1, 1]))
    U, _, Vt = np.linalg.svd(M)
    return U @ np.diag([1, 1, np.linalg.det(U @ Vt)]) @ Vt


def spread(kind, d):
    if kind == "yaw":
        return np.sqrt(np.mean(np.sum(d[:, :2] ** 2, axis=1)))
    return np.sqrt(np.sort(np.linalg.eigvalsh(d.T @ d / len(d)))[1])


def align(kind, p_true, R_true, p_est, R_est):
    if kind == "none":
        return np.eye(3), np.zeros(3), "positions"
    a, b = p_true - p_true.mean(0), p_est - p_est.mean(0)
    source = "positions"
    if min(spread(kind, a), spread(kind, b)) < 0.1:
        R, source = attitude_rotation(kind, R_true, R_est), "attitude"
    elif kind == "se3":  # Umeyama 1991, without scale
        U, _, Vt = np.linalg.svd(a.T @ b)
        R = U @ np.diag([1, 1, np.sign(np.linalg.det(U) * np.linalg.det(Vt))]) @ Vt
    else:  # the yaw that turns the planar vectors, as complex numbers, onto each other
        R = about_z(np.angle(np.sum((a[:, 0] + 1j * a[:, 1]) * np.conj(b[:, 0] + 1j * b[:, 1]))))
    return R, p_true.mean(0) - R @ p_est.mean(0), source


def rms(values):
    return float(np.sqrt(np.mean(np.square(values))))


def relative(distance, s, p_true, R_true, p_est, R_est):
    translation, rotation = [], []
    for i in range(len(s)):
        later = np.flatnonzero(s[i:] - s[i] >= distance)
        if len(later) == 0 or s[i + later[0]] - s[i] > 1.5 * distance:
            continue
        j = i + later[0]
        motion_true, motion_est = R_true[i].T @ (p_true[j] - p_true[i]), R_est[i].T @ (p_est[j] - p_est[i])
        turn_true, turn_est = R_true[i].T @ R_true[j], R_est[i].T @ R_est[j]
        translation.append(np.linalg.norm(motion_est - motion_true) / (s[j] - s[i]))
        rotation.append(np.linalg.norm(log(turn_true.T @ turn_est)) / (s[j] - s[i]))
    if not translation:
        return None
    return {"distance_m": distance, "stretches": len(translation), "translation_percent": 100 * np.mean(translation),
            "rotation_deg_per_m": np.degrees(np.mean(rotation))}


def consistency(values):
    inside = [CHI2_3_LOW <= v <= CHI2_3_HIGH for v in values]
    return {"mean": float(np.mean(values)), "inside_95": float(np.mean(inside))}


def slope_error(truth, estimate, sigma, ground):
    """Where the vehicle stands on the ground and the estimate knows a slope (it is not nan)."""
    chosen = ground & ~np.isnan(estimate)
    e = (truth - estimate)[chosen]
    return {"poses": int(np.sum(chosen)), "rmse_deg": np.degrees(rms(e)),
            "inside_3_sigma": float(np.mean(np.abs(e / sigma[chosen]) <= 3))}


def on_the_ground(estimate, index, times, extra, z_error):
    """Figures of the ground. The extra truth's mode is held until the next sample, its slopes are interpolated."""
    stamps = [int(x) for x in extra["timestamp [ns]"]]
    t = np.array([1e-9 * (stamp - stamps[0]) for stamp in stamps])
    at = np.array([1e-9 * (time - stamps[0]) for time in times])
    ground = numbers(extra, ["mode [0 ground 1 air]"])[[bisect.bisect_right(stamps, x) - 1 for x in times], 0] == 0
    own = numbers(estimate, ["on_ground"])[index, 0] == 1
    slope = {name: slope_error(np.interp(at, t, numbers(extra, [name + " [rad]"])[:, 0]),
                               *numbers(estimate, [name, "sigma_" + name])[index].T, ground)
             for name in ("slope_along", "slope_across")}
    return {"ground_poses": int(np.sum(ground)), "z_rmse_m": rms(z_error[ground]),
            "mode_agreement": float(np.mean(own == ground)), **slope}


def false_tracking(times, segments, health, travelled, p_true, R_true, p_est, R_est, P, known):
    """Stretches far off, from the start's alignment. P: covariances of the position, or nothing."""
    start = [i for i, time in enumerate(times) if time - times[0] <= 2_000_000_000]
    A = attitude_rotation("yaw", R_true[start], R_est[start])
    turns = [A.T @ a @ b.T for a, b in zip(R_true[start], R_est[start])]
    yaws = [np.arctan2(M[1, 0] - M[0, 1], M[0, 0] + M[1, 1]) for M in turns]
    e = (p_true - p_true[start].mean(0)) @ A + p_est[start].mean(0) - p_est
    beyond = np.linalg.norm(e, axis=1) > np.maximum(0.1, 0.05 * (travelled - travelled[0]))
    if P is not None:
        arm = rms(yaws) * np.cross([0, 0, 1], p_est - p_est[0])
        S = P + 0.02 ** 2 * np.eye(3) + arm[:, :, None] * arm[:, None, :]
        beyond |= np.einsum("ki,kij,kj->k", e, np.linalg.inv(S), e) > 25
    stretches, first = [], 0
    for i in range(1, len(times) + 1):
        if i < len(times) and beyond[i] and beyond[i - 1] and segments[i] == segments[i - 1]:
            continue
        if beyond[first] and times[i - 1] - times[first] >= 1_000_000_000:
            said = sum(times[k + 1] - times[k] for k in range(first, i - 1) if health[k].startswith("tracking"))
            stretches.append({"from_ns": times[first], "to_ns": times[i - 1], "tracking_s": 1e-9 * said,
                              "largest_error_m": float(np.max(np.linalg.norm(e[first:i], axis=1)))})
        first = i
    return {"percent": 100 * sum(s["tracking_s"] for s in stretches) / known,
            "far_off_percent": 100e-9 * sum(s["to_ns"] - s["from_ns"] for s in stretches) / known, "stretches": stretches}


def evaluate(estimate, truth, extra, kind):
    t_est, t = [int(x) for x in estimate["t_ns"]], [int(x) for x in truth["timestamp [ns]"]]
    p_all, R_all = numbers(truth, ["p_x", "p_y", "p_z"]), matrix(numbers(truth, ["q_w", "q_x", "q_y", "q_z"]))
    matches, outside, in_gaps = associate(t_est, t, p_all, R_all)
    index = [m[0] for m in matches]
    times = [t_est[i] for i in index]
    p_true, R_true = np.array([m[1] for m in matches]), np.array([m[2] for m in matches])
    p_own = numbers(estimate, ["p_x", "p_y", "p_z"])[index]
    R_own = matrix(numbers(estimate, ["q_w", "q_x", "q_y", "q_z"]))[index]
    A, a, source = align(kind, p_true, R_true, p_own, R_own)
    p_est, R_est = p_own @ A.T + a, A @ R_own
    error = p_true - p_est
    angles = [np.linalg.norm(log(x @ y.T)) for x, y in zip(R_true, R_est)]
    s = travelled(t, p_all, times, p_true)
    holes = gaps(t)
    known = t[-1] - t[0] - sum(b - a for a, b in holes)
    absent = [(t[0], max(t[0], t_est[0])), *gaps(t_est), (min(t[-1], t_est[-1]), t[-1])]
    missed = sum(max(0, min(b, d) - max(a, c)) for a, b in zip(t, t[1:]) if (a, b) not in holes for c, d in absent)
    covered = known - missed

    has_covariance = "cov_x_x" in estimate
    S = attitude_rotation("yaw" if has_covariance else kind, R_true[:1], R_own[:1])
    p_start = (p_true - p_true[0]) @ S + p_own[0]  # S takes the estimate's axes to the truth's
    e_p = p_start - p_own
    e_r = [log(S.T @ x @ y.T) for x, y in zip(R_true, R_own)]
    gap_est, gap_true = np.linalg.norm(p_est[-1] - p_est[0]), np.linalg.norm(p_true[-1] - p_true[0])

    nees = P_position = None
    if has_covariance:
        P = np.zeros((len(t_est), 6, 6))
        for i in range(6):
            for j in range(i, 6):
                P[:, i, j] = P[:, j, i] = numbers(estimate, [f"cov_{ERRORS[i]}_{ERRORS[j]}"])[:, 0]
        P_position = P[index][:, :3, :3]
        P = P[index][1:]
        nees = {"frames": len(P), "skipped": 0,
                "position": consistency([e @ np.linalg.inv(C[:3, :3]) @ e for e, C in zip(e_p[1:], P)]),
                "orientation": consistency([e @ np.linalg.inv(C[3:, 3:]) @ e for e, C in zip(e_r[1:], P)])}

    length = s[-1] - s[0]
    rpe = [relative(d, s, p_true, R_true, p_est, R_est) for d in (1.0, 5.0, 10.0, 20.0)]
    return {"poses": len(t_est), "matched": len(matches), "outside_truth": outside, "in_truth_gaps": in_gaps,
            "rotation_from": source, "duration_s": 1e-9 * (times[-1] - times[0]), "coverage": covered / known,
            "length_m": length, "ate_rmse_m": rms(np.linalg.norm(error, axis=1)),
            "ate_percent": 100 * rms(np.linalg.norm(error, axis=1)) / length if length >= 0.1 else None,
            "ate_max_m": float(np.max(np.linalg.norm(error, axis=1))), "z_rmse_m": rms(error[:, 2]),
            "rotation_rmse_deg": np.degrees(rms(angles)), "rpe": [r for r in rpe if r],
            "start_to_end": {"error_m": float(np.linalg.norm(e_p[-1])), "estimated_m": float(gap_est),
                             "truth_m": float(gap_true), "difference_m": float(abs(gap_est - gap_true))},
            "nees": nees,
            "false_tracking": false_tracking(times, [m[3] for m in matches], [estimate["health"][i] for i in index], s, p_true,
                                             R_true, p_own, R_own, P_position, 1e-9 * known),
            "ground": on_the_ground(estimate, index, times, extra, error[:, 2])}


if __name__ == "__main__":
    files = [read(path) for path in sys.argv[1:]]
    print(json.dumps({kind: evaluate(*files, kind) for kind in ("se3", "yaw", "none")}))
