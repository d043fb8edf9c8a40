#!/usr/bin/python3
"""Replaces the boxes of a detector by the projections of the true objects, to see what better boxes would gain.

Each box of the detector that overlaps the projection of a true object by an IoU of at least --min-iou becomes that
projection: of the whole solid, also where something hides it, clipped to the image. It keeps its label and score.
Other boxes stay as they are. Needs objects_gt.json, groundtruth.txt and camera.yaml in the sequence folder. Objects
that reach behind the camera, and frames without a true pose, keep the boxes of the detector.

    scripts/true-boxes.py data/desk --output out/true-boxes.txt
    sqslam run data/desk --detections out/true-boxes.txt --output out/desk
"""
import argparse
import bisect
import json
import math
import pathlib
import re
import sys

MAX_GAP = 0.2  # seconds between two true poses, between which poses are interpolated
NEAR = 0.01  # metres in front of the camera, from which points are projected
EXPONENTS = {"cuboid": (0.1, 0.1), "cylinder": (0.1, 1.0), "ellipsoid": (1.0, 1.0)}


def lines(path):
    return [line.split() for line in path.read_text().splitlines() if line.strip() and not line.startswith("#")]


def read_camera(path):
    text = path.read_text()
    camera = {name: float(re.search(rf"^{name}: *([-\d.e]+)", text, re.M)[1])
              for name in ("width", "height", "fx", "fy", "cx", "cy")}
    distortion = re.search(r"^distortion: *\[(.*?)\]", text, re.M | re.S)
    k = [float(value) for value in distortion[1].split(",")] if distortion else []
    camera["k"] = k + [0.0] * (5 - len(k))
    camera["fisheye"] = re.search(r"^distortion_model: *fisheye", text, re.M) is not None
    return camera


def distort(camera, x, y):
    """The pixel of a point of the plane z = 1."""
    k = camera["k"]
    r = math.hypot(x, y)
    if camera["fisheye"]:
        theta = math.atan(r)
        t = theta * theta
        scale = theta * (1 + t * (k[0] + t * (k[1] + t * (k[2] + t * k[3])))) / r if r > 1e-12 else 1.0
        x, y = scale * x, scale * y
    else:
        s = r * r
        radial = 1 + s * (k[0] + s * (k[1] + s * k[4]))
        x, y = (x * radial + 2 * k[2] * x * y + k[3] * (s + 2 * x * x),
                y * radial + k[2] * (s + 2 * y * y) + 2 * k[3] * x * y)
    return camera["fx"] * x + camera["cx"], camera["fy"] * y + camera["cy"]


def signed_power(value, exponent):
    return math.copysign(abs(value) ** exponent, value)


def surface(entry):
    """Points in the world frame whose convex hull is the object."""
    a, b, c = entry["half_size"]
    primitive = entry.get("primitive", "superquadric")
    e1, e2 = entry["shape"] if "shape" in entry else EXPONENTS[primitive]
    sharp = (e1, e2) == EXPONENTS.get(primitive)  # edges as sharp as those of the primitive
    ring = [2 * math.pi * i / 48 for i in range(48)]
    if sharp and primitive == "cuboid":
        steps = [-1 + i / 4 for i in range(9)]
        points = [(a * x, b * y, c * z) for x in steps for y in steps for z in steps
                  if sum(abs(v) == 1 for v in (x, y, z)) > 1]
    elif sharp and primitive == "cylinder":
        points = [(a * math.cos(t), b * math.sin(t), z) for t in ring for z in (-c, c)]
    else:
        points = []
        for i in range(1, 24):
            latitude = math.pi * (i / 24 - 0.5)
            flat, height = math.cos(latitude) ** e1, signed_power(math.sin(latitude), e1)
            points += [(a * flat * signed_power(math.cos(t), e2), b * flat * signed_power(math.sin(t), e2), c * height)
                       for t in ring]
        points += [(0, 0, -c), (0, 0, c)]
    if "T_world_object" in entry:
        rows = entry["T_world_object"]
        rows = rows if isinstance(rows[0], list) else [rows[i:i + 4] for i in range(0, 16, 4)]
    else:
        cos, sin = math.cos(entry.get("yaw", 0.0)), math.sin(entry.get("yaw", 0.0))
        x, y, z = entry["center"]
        rows = [[cos, -sin, 0, x], [sin, cos, 0, y], [0, 0, 1, z]]
    return [[row[0] * p[0] + row[1] * p[1] + row[2] * p[2] + row[3] for row in rows[:3]] for p in points]


def rotation(q):
    x, y, z, w = q
    return [[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]]


def slerp(a, b, share):
    cos = sum(x * y for x, y in zip(a, b))
    b, cos = ([-y for y in b], -cos) if cos < 0 else (b, cos)
    angle = math.acos(min(1.0, cos))
    if angle < 1e-6:
        return a
    return [(math.sin((1 - share) * angle) * x + math.sin(share * angle) * y) / math.sin(angle) for x, y in zip(a, b)]


def pose_at(poses, times, time):
    """Position and quaternion of the camera in the world; None without a true pose around that time."""
    after = bisect.bisect_left(times, time - 1e-6)
    if after == len(times):
        return None
    if abs(times[after] - time) <= 1e-6:
        return poses[after][1:4], poses[after][4:8]
    if after == 0 or times[after] - times[after - 1] > MAX_GAP:
        return None
    a, b = poses[after - 1], poses[after]
    share = (time - a[0]) / (b[0] - a[0])
    return [x + share * (y - x) for x, y in zip(a[1:4], b[1:4])], slerp(a[4:8], b[4:8], share)


def project(points, pose, camera):
    """The box around the points as left, top, right, bottom; None if it is not in the image."""
    t, r = pose[0], rotation(pose[1])
    us, vs = [], []
    for p in points:
        d = [p[i] - t[i] for i in range(3)]
        x, y, z = (r[0][i] * d[0] + r[1][i] * d[1] + r[2][i] * d[2] for i in range(3))
        if z < NEAR:
            return None
        u, v = distort(camera, x / z, y / z)
        us.append(u)
        vs.append(v)
    box = (max(0.0, min(us)), max(0.0, min(vs)), min(camera["width"], max(us)), min(camera["height"], max(vs)))
    return box if box[0] < box[2] and box[1] < box[3] else None


def iou(a, b):
    width, height = min(a[2], b[2]) - max(a[0], b[0]), min(a[3], b[3]) - max(a[1], b[1])
    common = max(0.0, width) * max(0.0, height)
    return common / ((a[2] - a[0]) * (a[3] - a[1]) + (b[2] - b[0]) * (b[3] - b[1]) - common)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("sequence", type=pathlib.Path, help="a sequence folder with ground truth")
    parser.add_argument("--detections", type=pathlib.Path, help="the detector's boxes (default: its boxes.txt)")
    parser.add_argument("--output", type=pathlib.Path, required=True, help="the file of boxes to write")
    parser.add_argument("--min-iou", type=float, default=0.3, help="with the projection of a true object (default 0.3)")
    parser.add_argument("--only-true", action="store_true", help="leave out boxes without a true object")
    arguments = parser.parse_args()
    sequence = arguments.sequence
    try:
        camera = read_camera(sequence / "camera.yaml")
        document = json.loads((sequence / "objects_gt.json").read_text())
        objects = [surface(entry) for entry in (document["objects"] if isinstance(document, dict) else document)]
        poses = [[float(v) for v in line] for line in lines(sequence / "groundtruth.txt")]
        detections = lines(arguments.detections or sequence / "boxes.txt")
    except OSError as error:
        sys.exit(f"{error.filename}: {error.strerror}, expected a sequence with ground truth and boxes")
    times = [pose[0] for pose in poses]
    projections = {}  # by timestamp
    text, replaced = "# timestamp label score x y w h\n", 0
    for time, label, score, *box in detections:
        if time not in projections:
            pose = pose_at(poses, times, float(time))
            projections[time] = [project(points, pose, camera) for points in objects] if pose else []
        x, y, width, height = map(float, box[:4])
        detected = (x, y, x + width, y + height)
        candidates = [(iou(detected, projected), projected) for projected in projections[time] if projected]
        overlap, best = max(candidates, default=(0.0, None))
        if overlap >= arguments.min_iou:
            replaced += 1
            detected = best
        elif arguments.only_true:
            continue
        left, top, right, bottom = detected
        text += f"{time} {label} {score} {left:.2f} {top:.2f} {right - left:.2f} {bottom - top:.2f}\n"
    arguments.output.write_text(text)
    print(f"{replaced} of {len(detections)} boxes replaced")


if __name__ == "__main__":
    main()
