#!/usr/bin/python3
"""Compares dense and sparse clouds of densified runs with the points that COLMAP triangulates from the same poses.

COLMAP (Debian's 3.8, on the CPU) extracts SIFT features of the keyframes, matches each keyframe with the next ten and
those 2^k after it (its sequential matcher), and triangulates with `point_triangulator`, which keeps the poses fixed.
Each cloud is then written as depth maps of the keyframes, and `sqslam eval --dense` evaluates all three. COLMAP's
points count in the keyframes of their tracks; points of the sparse map count in every keyframe that they project
into, unless a nearer point lies within ten pixels. Prints a Markdown table.

    scripts/compare-colmap.py out/kitchen=../data/redkitchen out/desk=../data/blender_desk_a --work out/colmap
"""
import argparse
import json
import pathlib
import re
import shutil
import sqlite3
import struct
import subprocess
import sys
import zlib

ROOT = pathlib.Path(__file__).resolve().parent.parent
PROGRAM = ROOT / "build/release/bin/sqslam"
HIDING = 10  # pixels about a nearer point in which a sparse point counts as hidden
NEARER = 0.95  # depth over that of the other below which a point counts as nearer


def rotation(q):
    x, y, z, w = q
    return [[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]]


def into_camera(q, t, p):
    """p_camera of a pose T_map_camera, quaternion x y z w."""
    r = rotation(q)
    d = [p[i] - t[i] for i in range(3)]
    return [sum(r[i][k] * d[i] for i in range(3)) for k in range(3)]


def lines(path):
    return [line.split() for line in path.read_text().splitlines() if line and not line.startswith("#")]


def colmap(*arguments):
    done = subprocess.run(["colmap", *map(str, arguments)], capture_output=True, text=True,
                          env={"QT_QPA_PLATFORM": "offscreen", "PATH": "/usr/bin:/bin", "HOME": "/tmp"})
    if done.returncode:
        sys.exit(f"colmap {arguments[0]}: {done.stdout[-500:]} {done.stderr[-500:]}")


def colmap_camera(path):
    """The camera as COLMAP has it: model, parameters, width and height. Its pixel centres are at a half."""
    camera = dict(re.findall(r"^(\w+): *([^#\n]+)", path.read_text(), re.M))
    k = [float(v) for v in re.findall(r"[-\d.e]+", camera.get("distortion", ""))]
    fx, fy, cx, cy = [float(camera[name]) for name in ("fx", "fy", "cx", "cy")]
    fisheye = camera.get("distortion_model", "").strip() == "fisheye"
    k += [0.0] * ((4 if fisheye else 8) - len(k))  # k1 k2 k3 k4, or k1 k2 p1 p2 k3 k4 k5 k6
    return ("OPENCV_FISHEYE" if fisheye else "FULL_OPENCV", [fx, fy, cx + 0.5, cy + 0.5] + k,
            camera["width"].strip(), camera["height"].strip())


def triangulate(result, sequence, work):
    """Points that COLMAP triangulates: positions by number, and the numbers seen by each keyframe's timestamp."""
    model, params, width, height = colmap_camera(result / "camera.yaml")
    images = {f"{float(line[0]):.6f}": line[1] for line in lines(sequence / "rgb.txt")}
    poses = {}
    (work / "images").mkdir(parents=True)
    for number, line in enumerate(lines(result / "keyframes.txt")):
        image = sequence / images[f"{float(line[0]):.6f}"]
        name = f"{number:05}{image.suffix}"
        (work / "images" / name).symlink_to(image.resolve())
        poses[name] = [float(v) for v in line]
    database, pictures = work / "database.db", work / "images"
    colmap("feature_extractor", "--database_path", database, "--image_path", pictures, "--ImageReader.single_camera", 1,
           "--ImageReader.camera_model", model, "--ImageReader.camera_params", ",".join(map(str, params)),
           "--SiftExtraction.use_gpu", 0)
    colmap("sequential_matcher", "--database_path", database, "--SiftMatching.use_gpu", 0)
    ids = dict(sqlite3.connect(database).execute("SELECT name, image_id FROM images"))
    posed, out = work / "posed", work / "out"
    posed.mkdir()
    out.mkdir()
    (posed / "points3D.txt").write_text("")
    (posed / "cameras.txt").write_text(
        f"1 {model} {width} {height} {' '.join(map(str, params))}\n")
    text = ""
    for name, (_, x, y, z, *q) in poses.items():
        t = into_camera(q, [0, 0, 0], [-x, -y, -z])
        text += f"{ids[name]} {q[3]} {-q[0]} {-q[1]} {-q[2]} {t[0]} {t[1]} {t[2]} 1 {name}\n\n"
    (posed / "images.txt").write_text(text)
    colmap("point_triangulator", "--database_path", database, "--image_path", pictures, "--input_path", posed,
           "--output_path", out)
    colmap("model_converter", "--input_path", out, "--output_path", out, "--output_type", "TXT")
    points, seen = {}, {}
    stamps = {str(ids[name]): pose[0] for name, pose in poses.items()}
    for line in lines(out / "points3D.txt"):
        points[int(line[0])] = [float(v) for v in line[1:4]]
        for image in line[8::2]:
            seen.setdefault(round(stamps[image], 4), set()).add(int(line[0]))
    return points, seen


def sparse(result):
    """Points of points.ply by number."""
    data = (result / "points.ply").read_bytes()
    header, body = data.split(b"end_header\n", 1)
    sizes = {"float": "f", "double": "d", "uchar": "B", "int": "i"}
    fields = re.findall(r"property (\w+) (\w+)", header.decode())
    row = struct.Struct("<" + "".join(sizes[kind] for kind, _ in fields))
    return dict(enumerate(values[:3] for values in row.iter_unpack(body)))


def without_hidden(pixels):
    cells = {}
    for (u, v), z in pixels.items():
        cell = (u // HIDING, v // HIDING)
        cells[cell] = min(z, cells.get(cell, z))
    near = lambda u, v: min(cells.get((u // HIDING + i, v // HIDING + k), 1e9) for i in (-1, 0, 1) for k in (-1, 0, 1))
    return {at: z for at, z in pixels.items() if near(*at) >= NEARER * z}


def write_depth(result, target, points, seen):
    """A result whose kept depth maps show these points alone, in the keyframes that see them (None: all)."""
    target.mkdir(parents=True)
    for name in ("trajectory.txt", "keyframes.txt", "camera.yaml", "map.sqmap", "objects.json"):
        shutil.copy(result / name, target / name)
    stamps = [float(line[0]) for line in lines(result / "keyframes.txt")]
    database = sqlite3.connect(target / "map.sqmap")
    rows = list(database.execute("SELECT keyframe, frame_index, camera FROM depth_maps ORDER BY frame_index"))
    if len(rows) != len(stamps):
        sys.exit(f"{result}: {len(rows)} depth maps of {len(stamps)} keyframes, expected one of each")
    for (keyframe, _, header), stamp in zip(rows, stamps):
        width, height, fx, fy, cx, cy, *pose = struct.unpack("<13d", header[:104])
        pixels = {}
        for number in points if seen is None else seen.get(round(stamp, 4), ()):
            x, y, z = into_camera(pose[:4], pose[4:], points[number])
            u, v = (round(fx * x / z + cx), round(fy * y / z + cy)) if z > 0 else (-1, -1)
            if 0 <= u < width and 0 <= v < height:
                pixels[u, v] = min(z, pixels.get((u, v), z))
        if seen is None:
            pixels = without_hidden(pixels)
        inverse = [1 / z for z in pixels.values()] or [1.0]
        least, most = min(inverse), max(inverse)
        flat = [0] * int(width * height)
        for (u, v), z in pixels.items():
            flat[v * int(width) + u] = 1 + round((1 / z - least) / ((most - least) or 1.0) * 65534)
        steps = [(value - left) & 65535 for value, left in zip(flat, [0] + flat)]
        kept = struct.pack("<2d", least, most) + zlib.compress(
            bytes(s & 255 for s in steps) + bytes(s >> 8 for s in steps))
        database.execute("UPDATE depth_maps SET kept = ?, views = ? WHERE keyframe = ?",
                         (kept, zlib.compress(bytes(1 if value else 0 for value in flat)), keyframe))
    database.commit()
    database.close()


def measured(result, sequence):
    subprocess.run([PROGRAM, "eval", result, "--ground-truth", sequence, "--dense"], check=True, capture_output=True)
    return json.loads((result / "dense_eval.json").read_text())


def row(name, cloud, count, e):
    share = e["complete"] + e["filled"]
    print(f"| {name} | {cloud} | {count:,} | {100 * share:.{1 if share > 0.05 else 2}f} % "
          f"| {1e3 * e['measured']['median']:.1f}, {1e3 * e['measured']['p90']:.1f} mm |", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("pairs", nargs="+", metavar="RESULT=SEQUENCE", help="a densified result and what it was made of")
    parser.add_argument("--work", type=pathlib.Path, required=True, help="a new folder for what COLMAP makes")
    arguments = parser.parse_args()
    if not shutil.which("colmap"):
        sys.exit("colmap is not there: apt-get install colmap")
    print("| on | cloud | points | share of pixels | median, p90 |\n| --- | --- | --- | --- | --- |")
    for pair in arguments.pairs:
        result, sequence = map(pathlib.Path, pair.split("="))
        work = arguments.work / sequence.name
        points = sparse(result)
        write_depth(result, work / "sparse", points, None)
        row(sequence.name, "sqslam, sparse", len(points), measured(work / "sparse", sequence))
        points, seen = triangulate(result, sequence, work / "colmap")
        write_depth(result, work / "triangulated", points, seen)
        row(sequence.name, "COLMAP, sparse", len(points), measured(work / "triangulated", sequence))
        header = (result / "dense.ply").open("rb").read(500)
        count = int(re.search(rb"element vertex (\d+)", header)[1])
        row(sequence.name, "sqslam, dense", count, measured(result, sequence))


if __name__ == "__main__":
    main()
