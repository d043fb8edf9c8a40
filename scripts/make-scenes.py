#!/usr/bin/python3
"""Makes sequences unlike the bundled desk, to see what the program does with footage that nobody tuned it on.

Kinds: `street` (driving forward between houses, 10 images a second, wide images), `bend` (the same, round a corner),
`flight` (photographs straight down, side by side in strips), `orbit` (photographs round a table, 12 to 20 degrees
apart), `hall` (a walk round a corridor of four sides back to its start, 5 images a second), and rooms with objects:
`kitchen` (chairs pushed under a table), `lounge`, `office`. Every seed is another scene, camera and path. Sequences
that exist already are kept. Rooms have the truth of each object's hull, exact boxes of what is seen of it
(boxes.txt), boxes with independent errors (boxes_noisy.txt) and, as boxes_detector.txt, boxes whose errors last and
depend on class and side.

    scripts/make-scenes.py out/scenes --kinds street flight --seeds 1:4
"""
import argparse
import json
import math
import random
import subprocess
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
COLOURS = [[186, 150, 108], [60, 90, 110], [150, 50, 46], [70, 110, 80], [220, 214, 200], [96, 72, 56], [40, 84, 120],
           [210, 170, 70], [120, 90, 130], [168, 160, 150]]


class Scene:
    """Text of a scene description; lengths in metres (a street is a model of one at 1:20)."""

    def __init__(self, source):
        self.source, self.bodies, self.panels, self.waypoints = source, [], [], []
        self.objects, self.hulls = [], []

    def texture(self, pattern):
        colours = self.source.sample(COLOURS, 5)
        seed, title = self.source.randrange(10**6), f"NO {self.source.randrange(1000)}"
        return f'{{pattern: {pattern}, seed: {seed}, title: "{title}", colors: {json.dumps(colours)}}}'

    def body(self, center, half, pattern, yaw=0.0, shape=(0.1, 0.1)):
        numbers = [[round(float(value), 4) for value in row] for row in (half, shape, center)]
        self.bodies.append(f"  - {{half_size: {numbers[0]}, shape: {numbers[1]}, center: {numbers[2]}, "
                           f"yaw: {yaw:.1f},\n     texture: {self.texture(pattern)}}}\n")

    def object(self, label, at, half, pattern, yaw=0.0, shape=(0.1, 0.1), parts=()):
        """An object with truth, its lowest point at `at`. `parts`: (offset from the hull's centre, half size,
        exponents) of what is drawn in place of the hull `half`; the renderer knows them by the same id."""
        identity, center = len(self.hulls) + 1, [at[0], at[1], at[2] + half[2]]
        self.hulls.append({"id": identity, "label": label, "center": center, "half": list(half), "yaw": yaw,
                           "shape": list(shape)})
        texture, turn = self.texture(pattern), math.radians(yaw)
        for offset, size, exponents in parts or [((0, 0, 0), half, shape)]:
            place = [center[0] + offset[0] * math.cos(turn) - offset[1] * math.sin(turn),
                     center[1] + offset[0] * math.sin(turn) + offset[1] * math.cos(turn), center[2] + offset[2]]
            numbers = [[round(float(value), 4) for value in row] for row in (size, exponents, place)]
            self.objects.append(f"  - {{id: {identity}, label: {label}, half_size: {numbers[0]}, shape: {numbers[1]}, "
                                f"center: {numbers[2]}, yaw: {yaw:.1f},\n     texture: {texture}}}\n")

    def panel(self, corner, u, v, pattern):
        numbers = [[round(float(value), 4) for value in row] for row in (corner, u, v)]
        self.panels.append(f"  - {{corner: {numbers[0]}, u: {numbers[1]}, v: {numbers[2]}, shading_step: 0.3,\n"
                           f"     texture: {self.texture(pattern)}}}\n")

    def walls(self, low, high, height, pattern="poster"):
        """Four walls that face inwards."""
        (x0, y0), (x1, y1) = low, high
        for corner, u in (((x0, y1), (x1 - x0, 0)), ((x0, y0), (0, y1 - y0)), ((x1, y1), (0, y0 - y1)),
                          ((x1, y0), (x0 - x1, 0))):
            self.panel([*corner, 0], [*u, 0], [0, 0, height], pattern)

    def waypoint(self, position, look_at):
        self.waypoints.append(f"    - {{position: {[round(v, 4) for v in position]}, "
                              f"look_at: {[round(v, 4) for v in look_at]}}}\n")

    def write(self, path, name, frames, size, focal, fps, tremor):
        path.write_text(
            f"name: {name}\nframes: {frames}\n"
            f"camera: {{width: {size[0]}, height: {size[1]}, fx: {focal * size[0]:.1f}, fps: {fps}}}\n"
            f"motion:\n  tremor_position: {tremor[0]}\n  tremor_angle: {tremor[1]}\n  waypoints:\n"
            + "".join(self.waypoints) + "ambient: [0.8, 0.8, 0.8]\n"
            "lights:\n  - {center: [0, 0, 30], half_u: [0, 4, 0], half_v: [4, 0, 0], rgb: [6, 6, 6]}\n"
            "furniture:\n" + "".join(self.bodies) + ("objects:\n" + "".join(self.objects) if self.objects else "")
            + "panels:\n" + "".join(self.panels))


def houses(scene, along, side_of):
    """Houses on both sides of a road whose middle at `s` is `along(s)` with the left normal `side_of(s)`."""
    source = scene.source
    for side in (-1, 1):
        s = -0.5
        while s < 7.5:
            depth, width, height = source.uniform(0.1, 0.25), source.uniform(0.1, 0.3), source.uniform(0.12, 0.5)
            distance = source.uniform(0.25, 0.45) + depth
            (x, y), (nx, ny) = along(s + width), side_of(s + width)
            yaw = math.degrees(math.atan2(-nx, ny))
            scene.body([x + side * distance * nx, y + side * distance * ny, height], [width, depth, height],
                       source.choice(["poster", "package", "book"]), yaw)
            if source.random() < 0.6:  # a parked car
                (x, y), (nx, ny) = along(s), side_of(s)
                scene.body([x + side * 0.17 * nx, y + side * 0.17 * ny, 0.035], [0.1, 0.04, 0.035], "ceramic", yaw,
                           (0.4, 0.4))
            s += 2 * width + source.uniform(0.02, 0.4)


def street(source, scene, turn):
    radius = source.uniform(1.5, 2.5)

    def angle(s):
        return 0.0 if not turn else max(0.0, min(math.pi / 2, (s - 1.0) / radius))

    def along(s):
        a = angle(s)
        x = min(s, 1.0) + radius * math.sin(a) if turn else s
        y = radius * (1 - math.cos(a)) if turn else 0.0
        rest = max(0.0, s - 1.0 - radius * math.pi / 2) if turn else 0.0
        return (x, y + rest)

    def side_of(s):
        return (-math.sin(angle(s)), math.cos(angle(s)))

    houses(scene, along, side_of)
    scene.panel([-3, -6, 0], [16, 0, 0], [0, 16, 0], "terrazzo")
    scene.walls((-3, -6), (13, 10), 1.6, "plaster")
    count, length = 70 if turn else 50, (70 if turn else 50) * source.uniform(0.04, 0.07)
    for i in range(12):
        s = length * i / 11
        (x, y), (ax, ay) = along(s), along(s + 0.6)
        scene.waypoint([x, y, 0.08], [ax, ay, 0.075])
    return count, (1226, 370), source.uniform(0.5, 0.65), 10, (0.0005, 0.1)


def flight(source, scene):
    scene.panel([-7, -5, 0], [14, 0, 0], [0, 10, 0], "terrazzo")
    for _ in range(60):
        half = [source.uniform(0.1, 0.35), source.uniform(0.1, 0.35), source.uniform(0.03, 0.25)]
        scene.body([source.uniform(-5, 5), source.uniform(-3, 3), half[2]], half,
                   source.choice(["poster", "package", "wood", "book"]), source.uniform(0, 90))
    focal, height = source.uniform(0.7, 1.0), source.uniform(2.0, 2.8)
    step = height / focal * source.uniform(0.15, 0.25)  # of the image's width
    strips, per_strip = 3, 9
    for strip in range(strips):
        columns = range(per_strip) if strip % 2 == 0 else reversed(range(per_strip))
        for column in columns:
            x, y = (column - per_strip / 2) * step, (strip - 1) * 1.6 * step
            scene.waypoint([x + source.uniform(-0.05, 0.05), y, height + source.uniform(-0.1, 0.1)],
                           [x + 0.02, y + 0.15, 0])
    return strips * per_strip, (960, 720), focal, 1, (0.02, 1.0)


def orbit(source, scene):
    scene.panel([-3, -3, 0], [6, 0, 0], [0, 6, 0], "terrazzo")
    scene.walls((-3, -3), (3, 3), 2.5)
    scene.body([0, 0, 0.68], [0.6, 0.6, 0.03], "wood")
    for _ in range(14):
        half = [source.uniform(0.04, 0.12), source.uniform(0.04, 0.12), source.uniform(0.03, 0.18)]
        scene.body([source.uniform(-0.45, 0.45), source.uniform(-0.45, 0.45), 0.71 + half[2]], half,
                   source.choice(["package", "book", "ceramic", "marble"]), source.uniform(0, 90),
                   (0.1, source.choice([0.1, 1.0])))
    step, radius = math.radians(source.uniform(12, 20)), source.uniform(1.3, 1.8)
    count = int(1.6 * math.pi / step)
    for i in range(count):
        height = source.uniform(1.1, 1.5)
        scene.waypoint([radius * math.cos(i * step), radius * math.sin(i * step), height], [0, 0, 0.75])
    return count, (1280, 960), source.uniform(0.75, 1.1), 1, (0.02, 1.0)


def hall(source, scene):
    scene.panel([-4, -3, 0], [8, 0, 0], [0, 6, 0], "terrazzo")
    scene.walls((-4, -3), (4, 3), 2.5, "plaster")
    for a, b in (((2.4, 1.4), (-2.4, 1.4)), ((-2.4, 1.4), (-2.4, -1.4)), ((-2.4, -1.4), (2.4, -1.4)),
                 ((2.4, -1.4), (2.4, 1.4))):  # the block in the middle faces outwards
        scene.panel([*a, 0], [b[0] - a[0], b[1] - a[1], 0], [0, 0, 2.5], "plaster")
    for _ in range(34):  # posters, on both sides of the corridor
        width, height, bottom = source.uniform(0.4, 0.9), source.uniform(0.4, 1.0), source.uniform(0.7, 1.2)
        x, y, inner = source.uniform(-2.3, 1.5), source.uniform(-1.3, 0.5), source.random() < 0.5
        fx, fy = (1.41, 2.41) if inner else (2.99, 3.99)
        corner, u = source.choice([((x + width, fx), (-width, 0)), ((x, -fx), (width, 0)),
                                   ((-fy, y + width), (0, -width)), ((fy, y), (0, width))])
        if not inner:
            corner, u = (corner[0] + u[0], corner[1] + u[1]), (-u[0], -u[1])
        scene.panel([*corner, bottom], [*u, 0], [0, 0, height], "poster")
    for _ in range(16):
        half = [source.uniform(0.1, 0.25), source.uniform(0.1, 0.2), source.uniform(0.15, 0.45)]
        x, y = source.choice([(source.uniform(-3.7, 3.7), source.choice([-2.7, 2.7])),
                              (source.choice([-3.7, 3.7]), source.uniform(-2.7, 2.7))])
        scene.body([x, y, half[2]], half, source.choice(["package", "wood", "marble"]), source.uniform(0, 90))
    corners = [(-3.2, -2.2), (3.2, -2.2), (3.2, 2.2), (-3.2, 2.2)]
    for i in range(5 * 6 + 1):
        side, share = divmod(i, 6)
        (x0, y0), (x1, y1) = corners[side % 4], corners[(side + 1) % 4]
        (x2, y2) = corners[(side + 2) % 4]
        t = share / 6
        ahead = max(0.0, (t - 0.5) / 0.5)  # looks round the corner before it gets there
        tx, ty = x1 + ahead * (x2 - x1) * 0.6, y1 + ahead * (y2 - y1) * 0.6
        scene.waypoint([x0 + t * (x1 - x0), y0 + t * (y1 - y0), 1.4 + source.uniform(-0.05, 0.05)], [tx, ty, 1.1])
    return 260, (640, 480), source.uniform(0.7, 0.95), 5, (0.01, 0.8)


# --- Rooms with objects ----------------------------------------------------------------------------------------

BOX, ROUND, BALL = (0.1, 0.1), (0.1, 1.0), (1.0, 1.0)
THINGS = {  # half sizes in metres, relative spread, exponents, texture
    "bottle": ([0.037, 0.037, 0.125], 0.2, ROUND, "package"), "bowl": ([0.085, 0.085, 0.04], 0.2, (0.5, 1.0), "ceramic"),
    "cereal_box": ([0.095, 0.035, 0.145], 0.1, BOX, "package"), "book": ([0.11, 0.08, 0.016], 0.2, BOX, "book"),
    "can": ([0.033, 0.033, 0.06], 0.1, ROUND, "package"), "remote": ([0.09, 0.025, 0.012], 0.15, BOX, "package"),
    "vase": ([0.06, 0.06, 0.13], 0.25, (0.5, 1.0), "ceramic"), "apple": ([0.04, 0.04, 0.038], 0.1, BALL, "marble"),
    "toaster": ([0.14, 0.085, 0.095], 0.15, (0.3, 0.3), "ceramic"), "cup": ([0.055, 0.041, 0.047], 0.15, ROUND, "ceramic"),
    "microwave": ([0.25, 0.18, 0.145], 0.1, BOX, "package"), "keyboard": ([0.21, 0.068, 0.013], 0.1, BOX, "package"),
    "mouse": ([0.055, 0.032, 0.019], 0.1, (0.8, 0.8), "ceramic"), "teddy_bear": ([0.1, 0.085, 0.14], 0.25, (0.8, 0.8), "marble"),
    "cushion": ([0.22, 0.1, 0.21], 0.1, (0.7, 0.5), "marble"), "sports_ball": ([0.11, 0.11, 0.11], 0.1, BALL, "marble"),
    "laptop": ([0.17, 0.12, 0.1], 0.1, BOX, "package")}
CONFUSED = {"cup": "bowl", "toaster": "microwave", "vase": "bottle", "can": "cup", "book": "laptop", "cereal_box": "book",
            "couch": "chair", "armchair": "couch", "coffee_table": "dining_table", "tv": "laptop", "remote": "cell_phone"}


def put(scene, label, x, y, base, yaw=None):
    half, spread, shape, pattern = THINGS[label]
    size = math.exp(scene.source.gauss(0, spread))
    half = [size * value for value in half]
    yaw = scene.source.uniform(-90, 90) if yaw is None else yaw
    parts = ()
    if label == "cup":  # a body and a handle of three pieces at one side
        body, reach = half[1], 2 * (half[0] - half[1])
        middle = body - half[0]
        parts = [((middle, 0, 0), (body, body, half[2]), ROUND)]
        parts += [((half[0] - reach / 2 - 0.004, 0, side * 0.5 * half[2]), (reach / 2 + 0.004, 0.006, 0.006), BOX)
                  for side in (-1, 1)]
        parts.append(((half[0] - 0.006, 0, 0), (0.006, 0.006, 0.5 * half[2] + 0.006), BOX))
    if label == "laptop":
        parts = [((0, 0, 0.012 - half[2]), (half[0], half[1], 0.012), BOX),
                 ((0, half[1] - 0.01, 0), (half[0], 0.01, half[2]), BOX)]
    scene.object(label, (x, y, base), half, pattern, yaw, shape, parts)


def scatter(scene, labels, low, high, base):
    """Puts things on a rectangle so that they don't touch."""
    placed = []
    for label in labels:
        reach = 1.15 * math.hypot(*THINGS[label][0][:2])
        for _ in range(200):
            x, y = scene.source.uniform(low[0] + reach, high[0] - reach), scene.source.uniform(low[1] + reach, high[1] - reach)
            if all(math.hypot(x - a, y - b) > reach + r for a, b, r in placed):
                placed.append((x, y, reach))
                put(scene, label, x, y, base)
                break


def legs(half, thick, height):
    return [((x * (half[0] - thick), y * (half[1] - thick), height / 2 - half[2]), (thick, thick, height / 2), BOX)
            for x in (-1, 1) for y in (-1, 1)]


def table(scene, label, at, half, yaw=0.0):
    scene.object(label, (*at, 0), half, "wood", yaw, BOX,
                 [((0, 0, half[2] - 0.02), (half[0], half[1], 0.02), BOX)] + legs(half, 0.03, 2 * half[2] - 0.04))


def chair(scene, at, yaw):
    """Its back at -x."""
    half = [scene.source.uniform(0.22, 0.26), scene.source.uniform(0.2, 0.24), scene.source.uniform(0.41, 0.47)]
    seat = 0.45 - half[2]
    parts = [((0, 0, seat), (half[0], half[1], 0.02), BOX)] + legs(half, 0.02, 0.43)
    parts.append(((0.02 - half[0], 0, (seat + half[2]) / 2 + 0.05), (0.02, half[1], (half[2] - seat) / 2 - 0.05), BOX))
    parts += [((0.02 - half[0], y * (half[1] - 0.02), (seat + half[2]) / 2), (0.02, 0.02, (half[2] - seat) / 2), BOX)
              for y in (-1, 1)]
    scene.object("chair", (*at, 0), half, "wood", yaw, BOX, parts)


def couch(scene, label, at, yaw, half):
    """Its back at -x."""
    parts = [((0, 0, 0.22 - half[2]), (half[0], half[1], 0.22), (0.2, 0.2)),
             ((0.1 - half[0], 0, 0), (0.1, half[1], half[2]), (0.3, 0.2))]
    parts += [((0, y * (half[1] - 0.09), 0.3 - half[2]), (half[0], 0.09, 0.3), (0.3, 0.2)) for y in (-1, 1)]
    scene.object(label, (*at, 0), half, "marble", yaw, (0.2, 0.2), parts)


def screen(scene, label, at, base, half, yaw, foot):
    parts = ()
    if foot:
        parts = [((0, 0, 0.04), (half[0], 0.02, half[2] - 0.04), BOX), ((0, 0, 0.05 - half[2]), (0.03, 0.02, 0.05), BOX),
                 ((0, 0, 0.006 - half[2]), (0.4 * half[0], half[1], 0.006), BOX)]
    scene.object(label, (*at, base), half, "book", yaw, BOX, parts)


def walls_of_room(scene, low, high):
    scene.panel([*low, 0], [high[0] - low[0], 0, 0], [0, high[1] - low[1], 0], "terrazzo")
    scene.walls(low, high, 2.6, "plaster")
    for _ in range(5):
        x, z = scene.source.uniform(low[0] + 0.3, high[0] - 1.0), scene.source.uniform(1.1, 1.5)
        scene.panel([x, high[1] - 0.005, z], [scene.source.uniform(0.4, 0.7), 0, 0],
                    [0, 0, scene.source.uniform(0.4, 0.9)], "poster")


def half_round(scene, middle, radius, height):
    """A walk round one side of the middle of things, with the hand's ups and downs."""
    first, turn = math.radians(scene.source.uniform(190, 215)), math.radians(scene.source.uniform(110, 140))
    for i in range(10):
        angle, r = first + turn * i / 9, radius * scene.source.uniform(0.9, 1.1)
        scene.waypoint([middle[0] + r * math.cos(angle), middle[1] + r * math.sin(angle),
                        height + scene.source.uniform(-0.12, 0.12)],
                       [middle[0] + scene.source.uniform(-0.2, 0.2), middle[1] + scene.source.uniform(0, 0.3), middle[2]])
    return 300, (640, 480), scene.source.uniform(0.75, 0.95), 30, (0.002, 0.25)


def kitchen(source, scene):
    walls_of_room(scene, (-2.6, -3.2), (2.6, 2.0))
    half = [source.uniform(0.65, 0.8), source.uniform(0.4, 0.48), 0.37]
    table(scene, "dining_table", (0, 0), half)
    for x in (-0.5, 0.5):
        for side in (-1, 1):
            if (x, side) != (0.5, -1) or source.random() < 0.5:
                into = source.uniform(-0.1, 0.15)  # how far the seat is under the table
                chair(scene, (x * half[0] + source.uniform(-0.05, 0.05), side * (half[1] + 0.22 - into)),
                      -90 * side + source.uniform(-12, 12))
    scatter(scene, source.sample(["cup", "bowl", "bottle", "cereal_box", "book", "vase", "apple", "can", "remote"], 6)
            + ["cup"], (-half[0], -half[1]), (half[0], half[1]), 0.74)
    scene.body([0, 1.68, 0.45], [1.8, 0.3, 0.45], "wood")  # a counter
    for i, label in enumerate(source.sample(["microwave", "toaster", "bottle", "bowl", "vase"], 4)):
        put(scene, label, -1.2 + 0.8 * i + source.uniform(-0.1, 0.1), 1.65, 0.9, source.uniform(-15, 15))
    return half_round(scene, (0, 0.2, 0.7), 1.9, 1.55)


def lounge(source, scene):
    walls_of_room(scene, (-2.8, -3.4), (2.8, 2.2))
    couch(scene, "couch", (-1.3, 0.6), source.uniform(-15, 5), [0.45, 0.9, 0.42])
    couch(scene, "armchair", (1.35, 0.1), 180 + source.uniform(-15, 15), [0.42, 0.42, 0.45])
    half = [source.uniform(0.45, 0.55), 0.3, 0.21]
    table(scene, "coffee_table", (0, 0), half, source.uniform(-10, 10))
    scatter(scene, source.sample(["cup", "bowl", "book", "remote", "vase", "apple"], 4), (-0.35, -0.25), (0.35, 0.25), 0.42)
    scene.object("tv_stand", (0.2, 1.85, 0), [0.75, 0.22, 0.25], "wood")
    screen(scene, "tv", (0.2, 1.85), 0.5, [source.uniform(0.45, 0.6), 0.11, 0.34], source.uniform(-4, 4), True)
    scene.object("potted_plant", (1.7, 1.5, 0), [0.24, 0.24, 0.5], "marble", 0, (0.6, 1.0),
                 [((0, 0, -0.34), (0.15, 0.15, 0.16), ROUND), ((0, 0, 0.15), (0.24, 0.24, 0.35), BALL)])
    put(scene, "cushion", -1.35, 0.9, 0.44, 90 + source.uniform(-10, 10))
    put(scene, "teddy_bear", 1.3, 0.1, 0.44)
    put(scene, "sports_ball", 0.7, -0.75, 0)
    return half_round(scene, (0, 0.5, 0.45), 2.2, 1.5)


def office(source, scene):
    walls_of_room(scene, (-2.5, -3.0), (2.5, 0.9))
    half = [source.uniform(0.7, 0.85), 0.38, 0.365]
    table(scene, "desk", (0, 0.45), half)
    screen(scene, "monitor", (source.uniform(-0.25, 0.1), 0.65), 0.73, [source.uniform(0.25, 0.32), 0.1, 0.24],
           source.uniform(-10, 10), True)
    put(scene, "keyboard", source.uniform(-0.2, 0.1), 0.28, 0.73, source.uniform(-8, 8))
    put(scene, "mouse", 0.3, 0.28, 0.73)
    put(scene, "cup", -0.45, 0.35, 0.73)
    put(scene, "laptop", 0.52, 0.6, 0.73, source.uniform(-30, 10))
    scatter(scene, ["book", "bottle"], (-half[0], 0.42), (-0.38, 0.8), 0.73)
    chair(scene, (source.uniform(-0.2, 0.2), -0.05), 90 + source.uniform(-30, 30))
    scene.body([1.6, 0.6, 0.9], [0.35, 0.2, 0.9], "book")
    scene.object("backpack", (-1.2, 0.2, 0), [0.17, 0.11, 0.23], "package", 30, (0.4, 0.4))
    return half_round(scene, (0, 0.45, 0.75), 1.45, 1.4)


def rows_of(path):
    return [line.split() for line in path.read_text().splitlines() if line and not line.startswith("#")]


def save_rows(path, rows):
    path.write_text("# timestamp label score x y w h\n" + "".join(" ".join(row) + "\n" for row in rows))


def detector_boxes(rows, size, source):
    """Boxes with errors as a detector's: each class has its own bias at each side, errors last for about ten frames,
    some boxes are far off, misses come in spells, and some objects have another label in a part of the frames."""
    bias, state, kept = {}, {}, []
    for time, label, _, x, y, width, height, identity, visible in rows:
        left, top, width, height = (float(value) for value in (x, y, width, height))
        sides = bias.setdefault(label, [source.gauss(0, 0.03) for _ in range(4)])
        known = state.setdefault(identity, {"error": [0.0] * 4, "missed": 0, "confused": source.choice((0, 0, 0.15, 0.5))})
        known["error"] = [0.9 * error + math.sqrt(1 - 0.81) * source.gauss(0, 0.045) for error in known["error"]]
        far_off = [source.gauss(0, 0.15) if source.random() < 0.03 else 0.0 for _ in range(4)]
        if known["missed"] == 0 and source.random() < 0.03 + 0.1 * (1 - float(visible)):
            known["missed"] = source.randrange(2, 15)
        known["missed"] = max(0, known["missed"] - 1)
        wrong = source.random() < known["confused"]
        score = source.uniform(0.3, 0.9)
        if known["missed"] > 0:
            continue
        edges = [base + extent * (sides[i] + known["error"][i] + far_off[i])
                 for i, (base, extent) in enumerate(((left, width), (top, height), (left + width, width),
                                                     (top + height, height)))]
        cut = [min(max(edge, 0.0), size[i % 2] - 1.0) for i, edge in enumerate(edges)]
        if cut[2] - cut[0] > 4 and cut[3] - cut[1] > 4:
            kept.append([time, CONFUSED.get(label, label) if wrong else label, f"{score:.3f}", f"{cut[0]:.2f}",
                         f"{cut[1]:.2f}", f"{cut[2] - cut[0]:.2f}", f"{cut[3] - cut[1]:.2f}"])
    return kept


def write_truth_of_hulls(folder, scene, size, seed):
    """Replaces the truth and boxes of the drawn parts by those of whole objects."""
    truth = []
    for hull in scene.hulls:
        c, s = math.cos(math.radians(hull["yaw"])), math.sin(math.radians(hull["yaw"]))
        (x, y, z), sharp = hull["center"], hull["shape"][0] <= 0.3
        truth.append({"id": hull["id"], "label": hull["label"],
                      "primitive": "cuboid" if sharp and hull["shape"][1] <= 0.3 else
                                   "cylinder" if sharp and hull["shape"][1] == 1.0 else "superquadric",
                      "center": [x, y, z], "yaw": math.radians(hull["yaw"]),
                      "T_world_object": [c, -s, 0, x, s, c, 0, y, 0, 0, 1, z, 0, 0, 0, 1], "half_size": hull["half"],
                      "shape": hull["shape"]})
    (folder / "objects_gt.json").write_text(json.dumps(truth, indent=1) + "\n")
    exact = list({(row[0], row[7]): row for row in rows_of(folder / "boxes.txt")}.values())
    source = random.Random(f"boxes {seed}")
    noisy = []
    for row in exact:
        left, top, width, height = (float(value) for value in row[3:7])
        errors = [source.gauss(0, 0.03 * extent) for extent in (width, height, width, height)]
        cut = [min(max(edge, 0.0), size[i % 2] - 1.0) for i, edge in enumerate(
            (left + errors[0], top + errors[1], left + width + errors[2], top + height + errors[3]))]
        if source.random() > 0.1:
            noisy.append([*row[:3], *(f"{value:.2f}" for value in (cut[0], cut[1], max(1, cut[2] - cut[0]),
                                                                    max(1, cut[3] - cut[1])))])
    save_rows(folder / "boxes.txt", exact)
    save_rows(folder / "boxes_noisy.txt", noisy)
    save_rows(folder / "boxes_detector.txt", detector_boxes(exact, size, source))


KINDS = {"street": lambda source, scene: street(source, scene, False),
         "bend": lambda source, scene: street(source, scene, True), "flight": flight, "orbit": orbit, "hall": hall,
         "kitchen": kitchen, "lounge": lounge, "office": office}


def make_sequence(work, kind, seed, sqslam):
    """Renders a sequence unless it exists. Returns its folder."""
    folder = work / f"{kind}-{seed}"
    if (folder / "rgb.txt").exists():
        return folder
    source = random.Random(f"{kind} {seed}")
    scene = Scene(source)
    frames, size, focal, fps, tremor = KINDS[kind](source, scene)
    work.mkdir(parents=True, exist_ok=True)
    file = folder.with_suffix(".yaml")
    scene.write(file, folder.name, frames, size, focal, fps, tremor)
    subprocess.run([sqslam, "synth", file, "--output", folder, "--seed", str(seed), "--quiet"], check=True)
    if scene.hulls:
        write_truth_of_hulls(folder, scene, size, seed)
    return folder


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("work", type=Path, help="folder for the sequences")
    parser.add_argument("--kinds", nargs="+", choices=KINDS, default=list(KINDS), help="(default: all)")
    parser.add_argument("--seeds", default="1:4", help="A:B, without B (default: %(default)s)")
    parser.add_argument("--sqslam", type=Path, default=ROOT / "build/release/bin/sqslam", help="the program")
    arguments = parser.parse_args()
    first, end = map(int, arguments.seeds.split(":"))
    for kind in arguments.kinds:
        for seed in range(first, end):
            print(make_sequence(arguments.work, kind, seed, arguments.sqslam), flush=True)


if __name__ == "__main__":
    main()
