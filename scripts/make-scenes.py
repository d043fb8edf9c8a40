#!/usr/bin/python3
"""Makes sequences unlike the bundled desk, to see what the program does with footage that nobody tuned it on.

Kinds: `street` (driving forward between houses, 10 images a second, wide images), `bend` (the same, round a corner),
`flight` (photographs straight down, side by side in strips), `orbit` (photographs round a table, 12 to 20 degrees
apart), `hall` (a walk round a corridor of four sides back to its start, 5 images a second). Every seed is another
scene, camera and path. Sequences that exist already are kept.

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

    def texture(self, pattern):
        colours = self.source.sample(COLOURS, 5)
        seed, title = self.source.randrange(10**6), f"NO {self.source.randrange(1000)}"
        return f'{{pattern: {pattern}, seed: {seed}, title: "{title}", colors: {json.dumps(colours)}}}'

    def body(self, center, half, pattern, yaw=0.0, shape=(0.1, 0.1)):
        numbers = [[round(float(value), 4) for value in row] for row in (half, shape, center)]
        self.bodies.append(f"  - {{half_size: {numbers[0]}, shape: {numbers[1]}, center: {numbers[2]}, "
                           f"yaw: {yaw:.1f},\n     texture: {self.texture(pattern)}}}\n")

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
            "furniture:\n" + "".join(self.bodies) + "panels:\n" + "".join(self.panels))


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


KINDS = {"street": lambda source, scene: street(source, scene, False),
         "bend": lambda source, scene: street(source, scene, True), "flight": flight, "orbit": orbit, "hall": hall}


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
