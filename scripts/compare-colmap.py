#!/usr/bin/python3
"""Compares dense and sparse clouds of densified runs with the points that COLMAP triangulates from the same poses.

COLMAP (Debian's 3.8, on the CPU) extracts SIFT features of the keyframes, matches each keyframe with the next ten and
those 2^k after it (its sequential matcher), and triangulates with `point_triangulator`, which keeps the poses fixed.
`sqslam eval --dense` compares each cloud with the true one. Prints a Markdown table.

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

ROOT = pathlib.Path(__file__).resolve().parent.parent
PROGRAM = ROOT / "build/release/bin/sqslam"


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
    """Positions of the points that COLMAP triangulates."""
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
    return [[float(v) for v in line[1:4]] for line in lines(out / "points3D.txt")]


def sparse(result):
    """Positions of the points of points.ply."""
    data = (result / "points.ply").read_bytes()
    header, body = data.split(b"end_header\n", 1)
    sizes = {"float": "f", "double": "d", "uchar": "B", "int": "i"}
    fields = re.findall(r"property (\w+) (\w+)", header.decode())
    row = struct.Struct("<" + "".join(sizes[kind] for kind, _ in fields))
    return [values[:3] for values in row.iter_unpack(body)]


def write_cloud(result, target, points):
    """A result that holds these points as its dense cloud."""
    target.mkdir(parents=True)
    shutil.copy(result / "trajectory.txt", target / "trajectory.txt")
    header = f"ply\nformat ascii 1.0\nelement vertex {len(points)}\n"
    header += "".join(f"property float {axis}\n" for axis in "xyz") + "end_header\n"
    (target / "dense.ply").write_text(header + "".join(f"{x} {y} {z}\n" for x, y, z in points))
    return target


def row(name, cloud, result, sequence):
    subprocess.run([PROGRAM, "eval", result, "--ground-truth", sequence, "--dense"], check=True, capture_output=True)
    e = json.loads((result / "dense_eval.json").read_text())
    accuracy, completeness = e["accuracy"], e["completeness"]
    print(f"| {name} | {cloud} | {accuracy['points']:,} | {1e3 * accuracy['median']:.1f}, {1e3 * accuracy['p90']:.1f} mm "
          f"| {100 * completeness['within_20_mm']:.1f} % |", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("pairs", nargs="+", metavar="RESULT=SEQUENCE", help="a densified result and what it was made of")
    parser.add_argument("--work", type=pathlib.Path, required=True, help="a new folder for what COLMAP makes")
    arguments = parser.parse_args()
    if not shutil.which("colmap"):
        sys.exit("colmap is not there: apt-get install colmap")
    print("| on | cloud | points | accuracy: median, p90 | complete within 20 mm |\n| --- | --- | --- | --- | --- |")
    for pair in arguments.pairs:
        result, sequence = map(pathlib.Path, pair.split("="))
        work = arguments.work / sequence.name
        row(sequence.name, "sqslam, sparse", write_cloud(result, work / "sparse", sparse(result)), sequence)
        points = triangulate(result, sequence, work / "colmap")
        row(sequence.name, "COLMAP, sparse", write_cloud(result, work / "triangulated", points), sequence)
        row(sequence.name, "sqslam, dense", result, sequence)


if __name__ == "__main__":
    main()
