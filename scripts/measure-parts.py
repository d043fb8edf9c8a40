#!/usr/bin/env python3
"""Measures how well hulls and parts of objects follow the true surface.

usage: scripts/measure-parts.py [--labels chair table ...] [--within METRES] RESULT=SEQUENCE ...

Each RESULT has been evaluated against SEQUENCE (`sqslam eval`), which holds groundtruth.txt, objects_gt.json and
dense.ply, the true surface. A true point belongs to the smallest true box that it lies in; points close to the foot of
the box, which may be of the floor, are left out. For each object with a counterpart, prints the share of its points
within a distance (2 cm by default) of the surface of its hull, and of its parts; an object without parts counts with its hull."""
import argparse
import json
import pathlib

import numpy as np
from scipy.spatial import cKDTree

SEATS_AND_TABLES = ["chair", "armchair", "couch", "sofa", "stool", "bench", "dining_table", "table", "coffee_table", "desk"]


def read_points(path):
    with open(path, "rb") as file:
        kinds = {"float": "<f4", "double": "<f8", "uchar": "u1", "int": "<i4"}
        fields, count = [], 0
        for line in iter(lambda: file.readline().split(), [b"end_header"]):
            if line[:2] == [b"element", b"vertex"]:
                count = int(line[2])
            if line[0] == b"property":
                fields.append((line[2].decode(), kinds[line[1].decode()]))
        rows = np.frombuffer(file.read(), np.dtype(fields), count)
        return np.stack([rows[axis].astype(float) for axis in "xyz"], 1)


def positions(path):
    rows = [line.split() for line in path.read_text().splitlines() if line and not line.startswith("#")]
    return {round(float(row[0]), 3): np.array(row[1:4], float) for row in rows}


def world_from_map(result, sequence):
    """Least-squares scale, rotation and translation (Umeyama 1991)."""
    mapped, true = positions(result / "trajectory.txt"), positions(sequence / "groundtruth.txt")
    times = sorted(mapped.keys() & true.keys())
    a, b = np.array([mapped[t] for t in times]), np.array([true[t] for t in times])
    a0, b0 = a - a.mean(0), b - b.mean(0)
    u, d, vt = np.linalg.svd(b0.T @ a0)
    flip = np.diag([1, 1, np.sign(np.linalg.det(u @ vt))])
    R = u @ flip @ vt
    s = (d * np.diag(flip)).sum() / (a0 ** 2).sum()
    return s, R, b.mean(0) - s * R @ a.mean(0)


def scale(p, half, e1, e2):
    q = np.abs(p) / half + 1e-12
    e1, e2 = max(e1, 0.05), max(e2, 0.05)
    plan = np.logaddexp(2 / e2 * np.log(q[:, 0]), 2 / e2 * np.log(q[:, 1])) * e2 / e1
    return np.exp(np.clip(np.logaddexp(plan, 2 / e1 * np.log(q[:, 2])) * e1 / 2, -50, 50))


def surface(solids, spacing):
    """Points on the surface of a union: those on one solid and in no other. Solids: (centre, half sizes, e1, e2)."""
    points = []
    for i, (centre, half, e1, e2) in enumerate(solids):
        faces = []
        for axis in range(3):
            u, v = [a for a in range(3) if a != axis]
            counts = [max(2, int(np.ceil(2 * half[a] / spacing)) + 1) for a in (u, v)]
            grid = np.stack(np.meshgrid(*[np.linspace(-1, 1, n) for n in counts]), -1).reshape(-1, 2)
            for side in (-1.0, 1.0):
                face = np.full((len(grid), 3), side)
                face[:, [u, v]] = grid
                faces.append(face * half)
        p = np.concatenate(faces)
        p = p / scale(p, half, e1, e2)[:, None] + centre
        for j, (c, h, a, b) in enumerate(solids):
            if j != i:
                p = p[scale(p - c, h, a, b) > 1 - 1e-6]
        points.append(p)
    return np.concatenate(points)


def owned_points(points, objects):
    """For each object the points that belong to it."""
    owner, volume = np.full(len(points), -1), np.full(len(points), np.inf)
    for k, entry in enumerate(objects):
        T, half = np.array(entry["T_world_object"], float).reshape(4, 4), np.array(entry["half_size"], float)
        p = (points - T[:3, 3]) @ T[:3, :3]
        inside = (np.abs(p) <= half + 0.01).all(1) & (p[:, 2] > -half[2] + 0.02) & (half.prod() < volume)
        owner[inside], volume[inside] = k, half.prod()
    return [points[owner == k] for k in range(len(objects))]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--labels", nargs="+", default=SEATS_AND_TABLES)
    parser.add_argument("--within", type=float, default=0.02, metavar="METRES")
    parser.add_argument("pairs", nargs="+", metavar="RESULT=SEQUENCE")
    a = parser.parse_args()
    counts = []  # of each object: points, near its hull, near its parts
    for pair in a.pairs:
        result, sequence = map(pathlib.Path, pair.split("="))
        truth = json.loads((sequence / "objects_gt.json").read_text())
        truth = truth["objects"] if isinstance(truth, dict) else truth
        points = dict(zip([entry["id"] for entry in truth], owned_points(read_points(sequence / "dense.ply"), truth)))
        mapped = {entry["id"]: entry for entry in json.loads((result / "objects.json").read_text())["objects"]}
        s, R, t = world_from_map(result, sequence)
        print(f"{result}\n  {'object':<20} {'parts':>5} {'IoU':>6} {'points':>7} {'hull %':>7} {'parts %':>7}")
        for match in json.loads((result / "eval.json").read_text())["objects"]["matched"]:
            entry = mapped[match["object"]]
            own = points[match["ground_truth"]]
            if entry["label"] not in a.labels or not len(own):
                continue
            T, half = np.array(entry["T_map_object"]), np.array(entry["half_size"]) * s
            p = ((own - t) @ R / s - T[:3, 3]) @ T[:3, :3] * s
            hull = [(np.zeros(3), half, *entry["shape"])]
            parts = [(np.array(part["center"]) * half, np.array(part["half_size"]) * half, *part["shape"])
                     for part in entry.get("parts", [])]
            near = [np.count_nonzero(cKDTree(surface(solids, 0.25 * a.within)).query(p)[0] <= a.within)
                    for solids in (hull, parts or hull)]
            counts.append([len(p), *near])
            print(f"  {entry['id']:>3} {entry['label']:<16} {len(parts):>5} {match['iou']:>6.3f} {len(p):>7} "
                  f"{100 * near[0] / len(p):>7.1f} {100 * near[1] / len(p):>7.1f}")
    if counts:
        counts = np.array(counts, float)
        for name, (hull, parts) in (("mean of the objects", (counts[:, 1:] / counts[:, :1]).mean(0)),
                                    ("all points", counts[:, 1:].sum(0) / counts[:, 0].sum())):
            print(f"{name}: {100 * hull:.1f} % within {100 * a.within:g} cm of the hulls, {100 * parts:.1f} % of the parts: "
                  f"{parts / hull:.2f} times")


if __name__ == "__main__":
    main()
