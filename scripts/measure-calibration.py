#!/usr/bin/python3
"""Measures how well `sqslam run --camera auto` finds the focal length, and whether its interval holds the truth.

Renders sequences of the bundled room with random cameras (0.6 to 1.4 image widths, k1 from -0.3 to 0.1 as far as the
image does not fold over; with --fisheye lenses of 95 to 190 degrees) and random hand-held paths, one for each seed,
below WORK. Maps them and, given --data, the
sequences there whose camera is known, all without their calibration. Prints a Markdown table, then the share of
intervals that hold the truth, the median error, and the largest share of the frames that was played.

    scripts/measure-calibration.py out/calibration --seeds 101:121 --data ../data
"""
import argparse
import random
import re
import shutil
import statistics
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
WIDTH, HEIGHT, FPS = 640, 480, 30.0
KNOWN = ["redkitchen", "blender_desk_a", "blender_room_c", "tsukuba", "footage/hololens", "footage/street",
         "footage/brighton"]
# By COLMAP 3.8 from all 18 photographs, with a free focal length; their camera.yaml says 339.4 px.
BETTER_KNOWN = {"brighton": 421.8}
INTERVAL = re.compile(r"camera: (?:fisheye lens, )?focal length ([\d.]+) px .*95 %: ([\d.]+) to ([\d.]+) px")
PLAYED = re.compile(r"from (\d+) frames in (\d+) s")


def lowest_k1(focal):
    """The least k1 (with a margin) with which pixels at the corner still have a ray; `focal` in widths."""
    corner = 0.5 * (1.0 + (HEIGHT / WIDTH) ** 2) ** 0.5 / focal
    return max(-0.3, -0.9 * 4.0 / 27.0 / corner**2)


def random_camera(source, fisheye):
    if fisheye:
        return source.uniform(0.3, 0.6), source.uniform(-0.02, 0.04)
    focal = source.uniform(0.6, 1.4)
    return focal, source.uniform(lowest_k1(focal), 0.1)


def random_waypoints(source, count):
    """Waypoints of somebody who walks about in front of the desk and looks at it and at the walls beside it."""
    x, y, z = source.uniform(-1.0, 1.0), source.uniform(-1.5, -0.9), source.uniform(1.1, 1.4)
    text = ""
    for _ in range(count):
        look = [source.uniform(-0.9, 0.9), source.uniform(-0.1, 0.8), source.uniform(0.7, 1.2)]
        text += f"    - {{position: [{x:.3f}, {y:.3f}, {z:.3f}], look_at: [{look[0]:.3f}, {look[1]:.3f}, {look[2]:.3f}]}}\n"
        x = min(1.3, max(-1.3, x + source.choice([-1, 1]) * source.uniform(0.3, 0.6)))
        y = min(-0.8, max(-1.7, y + source.uniform(-0.25, 0.25)))
        z = min(1.5, max(1.0, z + source.uniform(-0.15, 0.15)))
    return text


def write_sequence(arguments, seed):
    """Renders the sequence of a seed unless it is there. Returns its folder."""
    folder = arguments.work / ("fisheye" if arguments.fisheye else "sequences") / str(seed)
    if (folder / "rgb.txt").exists():
        return folder
    source = random.Random(seed)
    focal, k1 = random_camera(source, arguments.fisheye)
    scene = (ROOT / "assets/scenes/desk.yaml").read_text()
    scene = re.sub(r"(  waypoints:\n)(?:    - .*\n)+",
                   lambda m: m[1] + random_waypoints(source, 2 + arguments.frames // 40), scene)
    scene = re.sub(r"^frames: .*", f"frames: {arguments.frames}", scene, flags=re.M)
    scene = re.sub(r"^camera: .*",
                   f"camera: {{width: {WIDTH}, height: {HEIGHT}, fx: {focal * WIDTH:.2f}, fps: {FPS}, "
                   f"distortion: [{k1:.4f}, 0.0, 0.0, 0.0]"
                   f"{', distortion_model: fisheye' if arguments.fisheye else ''}}}", scene, flags=re.M)
    folder.parent.mkdir(parents=True, exist_ok=True)
    file = folder.with_suffix(".yaml")
    file.write_text(scene)
    command = [arguments.sqslam, "synth", file, "--output", folder, "--quiet", "--seed", str(seed)]
    subprocess.run(command + ["--supersampling", "1"], check=True)
    return folder


def true_camera(folder):
    """Focal length and k1 of a sequence's camera.yaml."""
    text = (folder / "camera.yaml").read_text()
    distortion = re.search(r"distortion: \[([^,\]]+)", text)
    return float(re.search(r"fx: ([\d.]+)", text)[1]), float(distortion[1]) if distortion else 0.0


def found_k1(result):
    return true_camera(result)[1] if (result / "camera.yaml").exists() else float("nan")


def measure(arguments, name, folder):
    """Maps a sequence without its calibration. Returns a row of the table, or None without a map."""
    result = arguments.work / "runs" / name
    shutil.rmtree(result, ignore_errors=True)
    result.parent.mkdir(parents=True, exist_ok=True)
    command = [arguments.sqslam, "run", folder, "--camera", "auto", "--detector", "none", "--no-render", "--no-dense"]
    run = subprocess.run(command + ["--output", result], capture_output=True, text=True)
    said = INTERVAL.findall(run.stderr)
    if not said:
        return None
    focal, low, high = map(float, said[-1])
    truth, k1 = true_camera(folder)
    truth = BETTER_KNOWN.get(name, truth)
    frames, seconds = map(float, PLAYED.findall(run.stderr)[-1])
    images = [line for line in (folder / "rgb.txt").read_text().splitlines() if line and line[0] != "#"] if (
        folder / "rgb.txt").exists() else [path for path in folder.iterdir() if path.suffix.lower() in (".jpg", ".png")]
    return {"name": name, "truth": truth, "found": focal, "error": 100.0 * (focal / truth - 1.0), "low": low,
            "high": high, "holds": low <= truth <= high, "k1": k1, "found k1": found_k1(result),
            "played": frames / len(images), "seconds": seconds}


def print_row(row):
    print(f"| {row['name']} | {row['truth']:.1f} | {row['found']:.1f} | {row['error']:+.2f} % | "
          f"{row['low']:.1f} to {row['high']:.1f} | {'yes' if row['holds'] else 'NO'} | "
          f"{row['k1']:+.3f} | {row['found k1']:+.3f} | {100.0 * row['played']:.0f} % | {row['seconds']:.0f} s |",
          flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("work", type=Path, help="folder for sequences and results")
    parser.add_argument("--data", type=Path, help="folder that holds sequences with known cameras")
    parser.add_argument("--seeds", default="101:121", help="A:B, without B (default: %(default)s)")
    parser.add_argument("--fisheye", action="store_true", help="render fisheye lenses")
    parser.add_argument("--frames", type=int, default=150, help="of a rendered sequence (default: %(default)s)")
    parser.add_argument("--sqslam", type=Path, default=ROOT / "build/release/bin/sqslam", help="the program")
    arguments = parser.parse_args()
    first, end = map(int, arguments.seeds.split(":"))
    known = [name for name in KNOWN if arguments.data and (arguments.data / name / "camera.yaml").exists()]
    print("| sequence | true, px | found, px | error | 95 % interval, px | holds it | k1 | found k1 | frames played | "
          "time |")
    print("|" + " --- |" * 10, flush=True)
    rows = []
    for name in known + list(range(first, end)):
        folder = write_sequence(arguments, name) if isinstance(name, int) else arguments.data / name
        row = measure(arguments, str(name).split("/")[-1], folder)
        if row is None:
            print(f"| {name} | no map |", flush=True)
            continue
        print_row(row)
        rows.append(row)
    if not rows:
        sys.exit("measure-calibration: no sequence was mapped")
    print(f"\n{sum(row['holds'] for row in rows)} of {len(rows)} intervals hold the truth; median error "
          f"{statistics.median(abs(row['error']) for row in rows):.2f} %; at most "
          f"{100.0 * max(row['played'] for row in rows):.0f} % of the frames were played")


if __name__ == "__main__":
    main()
