#!/usr/bin/env python3
"""Compares the relations of results (relations.json) with those of the true objects.

usage: scripts/measure-relations.py [--list] RESULT=SEQUENCE ...

Each RESULT has been evaluated against SEQUENCE (`sqslam eval`), whose objects_gt.json holds the true objects. Their
relations are found by sampling: vertical rays through the true solids and distances between points in them, with the
definitions of slam/scene/scene_graph.h but none of its code. Objects without a counterpart are
left out. A relation of the map counts if it is more likely than not. `ground` stands for the floor and all surfaces;
in a scene nothing floats, so that truly everything that stands on no other object stands on the ground.

--list prints every relation that is true or found."""
import argparse
import json
import pathlib

import numpy as np
import yaml
from scipy.spatial import cKDTree

ROOT = pathlib.Path(__file__).resolve().parent.parent
TRAITS = yaml.safe_load((ROOT / "configs/classes.yaml").read_text())
EXPONENTS = {"cuboid": (0.1, 0.1), "cylinder": (0.1, 1.0), "ellipsoid": (1.0, 1.0)}


def turn_up(up):
    """Rotation that turns the unit vector `up` into z."""
    up = np.asarray(up) / np.linalg.norm(up)
    x = np.cross([0.0, 1.0, 0.0], up)
    if np.linalg.norm(x) < 1e-6:
        x = np.array([1.0, 0.0, 0.0])
    x /= np.linalg.norm(x)
    return np.stack([x, np.cross(up, x), up])


class Thing:
    def __init__(self, entry, R, random):
        self.id, self.label = entry["id"], entry["label"].replace(" ", "_")
        self.traits = TRAITS.get(self.label, {})
        T = np.array(entry["T_world_object"], float).reshape(4, 4)
        self.R, self.t = R @ T[:3, :3], R @ T[:3, 3]
        self.half = np.array(entry["half_size"], float)
        self.e1, self.e2 = entry.get("shape") or EXPONENTS[entry["primitive"]]
        p = random.uniform(-1.0, 1.0, (60000, 3)) * self.half
        p = p[self.scale(p) < 1.0]
        self.inside = (p @ self.R.T + self.t)[:6000]
        self.low, self.high = self.inside[:, 2].min(), self.inside[:, 2].max()
        self.width = np.sqrt(self.half[0] * self.half[1])
        self.height = self.high - self.low
        self.plan = cKDTree(self.inside[:, :2])
        self.seat, self.legs = self.traits.get("back", False), self.traits.get("legs", False)

    def scale(self, p_object):
        q = np.abs(p_object) / self.half
        plan = (q[..., 0] ** (2 / self.e2) + q[..., 1] ** (2 / self.e2)) ** (self.e2 / self.e1)
        return plan + q[..., 2] ** (2 / self.e1)

    def contains(self, p):
        return self.scale((p - self.t) @ self.R) < 1.0

    def spans(self, columns, z):
        """Lowest and highest z of the solid in each vertical column; nan where it is missed."""
        p = np.concatenate([np.repeat(columns[:, None, :], len(z), 1), np.broadcast_to(z[None, :, None], (len(columns), len(z), 1))], 2)
        hit = self.contains(p)
        level = np.where(hit, z, np.nan)
        some = hit.any(1)
        low, high = np.full(len(columns), np.nan), np.full(len(columns), np.nan)
        low[some], high[some] = np.nanmin(level[some], 1), np.nanmax(level[some], 1)
        return low, high


def tolerance(a):
    return max(0.02, 0.15 * a.height)


def gap(a, b):
    return a.plan.query(b.inside[::3, :2])[0].min()


def relations_of(things):
    """The set of (relation, id, id or "ground")."""
    z = np.arange(min(t.low for t in things) - 0.02, max(t.high for t in things) + 0.02, 0.004)
    place, found = {}, set()
    for a in things:
        middle = np.linalg.norm(a.inside[:, :2] - a.t[:2], axis=1) < 0.5 * a.width
        inner = a.inside[middle][:60, :2]
        own_low, _ = a.spans(inner, z)
        nearest = None
        for b in things:
            if a is b or a.traits.get("floor") or gap(a, b) > 0.01:
                continue
            share = b.contains(a.inside).mean()
            low, high = b.spans(inner, z)
            if (b.traits.get("hollow") or b.traits.get("holds")) and not b.seat and not b.legs and a.width < b.width and share > 0.25 and b.contains(np.array([a.t[0], a.t[1], b.t[2]])):
                nearest = (-1.0, "in", b.id)
                break
            with np.errstate(invalid="ignore"):
                foot = np.nanmin(own_low)
                height = np.abs(np.clip(foot, low + 0.3 * b.height, low + 0.7 * b.height) - foot if b.seat else high - foot)
                touching = height < tolerance(a)
            if touching.mean() >= 0.5:
                distance = np.median(height[touching])
                nearest = min(nearest or (np.inf,), (distance, "on", b.id))
        place[a.id] = nearest[2] if nearest else "ground"
        found.add((nearest[1] if nearest else "on", a.id, place[a.id]))
    for a in things:
        columns = a.inside[:100, :2]
        own_low, own_high = a.spans(columns, z)
        for b in things:
            if a is b or b.id == place[a.id] or a.id == place[b.id]:
                continue
            low, high = b.spans(columns, z)
            with np.errstate(invalid="ignore"):
                above = high - 0.1 * b.height > a.t[2] if b.legs else low + (0.3 * b.height if b.seat else 0.01) > own_high
            if above.mean() >= 0.3 and a.width < 2.0 * b.width and a.low < b.high - tolerance(a):
                found.add(("under", a.id, b.id))
    slender = {t.id: t.height > 10.0 * t.half[:2].min() and not t.traits.get("floor") for t in things}
    for a in things:
        for b in things:
            held = b.id == place[a.id] or a.id == place[b.id]
            common = min(a.high, b.high) - max(a.low, b.low)
            shared = common > 0.3 * min(a.height, b.height)
            if a is b or held:
                continue
            if slender[a.id] and b.half.prod() > a.half.prod() and shared and b.high > a.low + 0.4 * a.height and gap(a, b) < max(0.01, 0.5 * a.half[:2].min()):
                found.add(("leans against", a.id, b.id))
    for i, a in enumerate(things):
        for b in things[i + 1:]:
            if b.id == place[a.id] or a.id == place[b.id] or any((r, *p) in found for r in ("under", "leans against") for p in ((a.id, b.id), (b.id, a.id))):
                continue
            common = min(a.high, b.high) - max(a.low, b.low)
            same = place[a.id] == place[b.id] and (place[a.id] != "ground" or abs(a.low - b.low) < 0.05)
            if (same or common > 0.3 * min(a.height, b.height)) and gap(a, b) <= np.sqrt(a.width * b.width):
                found.add(("next to", a.id, b.id))
    return found


def mapped_relations(result, truth_of):
    data = json.loads((result / "relations.json").read_text())
    names = [truth_of.get(n["id"]) if n["kind"] == "object" else ("ground" if n["kind"] in ("surface", "floor") else None) for n in data["nodes"]]
    likely = {}
    for r in data["relations"]:
        a, b = names[r["subject"]], names[r["object"]]
        if a is not None and b is not None:
            if r["relation"] == "next to" and a > b:
                a, b = b, a
            key = (r["relation"], a, b)
            likely[key] = max(likely.get(key, 0.0), r["probability"])
    return {key for key, p in likely.items() if p >= 0.5}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("pairs", nargs="+", metavar="RESULT=SEQUENCE")
    parser.add_argument("--list", action="store_true")
    a = parser.parse_args()
    print(f"{'scene':<14}{'relation':<15}{'true':>6}{'found':>7}{'precision':>11}{'recall':>8}")
    for pair in a.pairs:
        result, sequence = map(pathlib.Path, pair.split("="))
        evaluation = json.loads((result / "eval.json").read_text())["objects"]
        truth_of = {m["object"]: m["ground_truth"] for m in evaluation["matched"]}
        file = json.loads((sequence / "objects_gt.json").read_text())
        entries = file if isinstance(file, list) else file["objects"]
        R = turn_up(file["up_world"] if isinstance(file, dict) and "up_world" in file else [0.0, 0.0, 1.0])
        random = np.random.default_rng(1)
        things = sorted((Thing(e, R, random) for e in entries), key=lambda t: t.id)
        things = [t for t in things if t.id in truth_of.values()]
        truth = relations_of(things)
        found = mapped_relations(result, truth_of)
        if a.list:
            name = {t.id: f"{t.label} {t.id}" for t in things} | {"ground": "ground"}
            for r, s, o in sorted(truth | found, key=str):
                print("  ", "right " if (r, s, o) in truth & found else "missed" if (r, s, o) in truth else "wrong ", name[s], r, name[o])
        for kind in ("on", "in", "under", "next to", "leans against", "all", "all but ground"):
            def of(s):
                return {r for r in s if kind in ("all", r[0]) or (kind == "all but ground" and r[2] != "ground")}
            right, true, all_found = len(of(truth & found)), len(of(truth)), len(of(found))
            if true + all_found > 0:
                print(f"{result.name:<14}{kind:<15}{true:>6}{all_found:>7}{right / max(all_found, 1):>11.2f}{right / max(true, 1):>8.2f}")


if __name__ == "__main__":
    main()
