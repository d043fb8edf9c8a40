#!/usr/bin/python3
"""Measures the SLAM core: accuracy, robustness, speed and memory over several runs of several sequences.

Needs the sequence folders redkitchen, tsukuba and blender_desk_a below DATA; missing ones are skipped. Below WORK it
makes harder variants of them from links and lists, a walk of many laps around the bundled desk, and two turns of a
camera in its room, once with identical posters. Prints one Markdown table of medians with the lowest and highest
values.

    scripts/measure-slam.py ../data out/measure
    scripts/measure-slam.py ../data out/measure --only redkitchen gap --runs 3 -- --deterministic

A name like redkitchen:20 means every 20th frame of a sequence, similar to photographs taken a second apart;
"strides" means all of these. redkitchen:shuffled shows every 15th frame in random order. "footage" means the folders
below DATA/footage: other people's films and photographs. "scenes" means those of make-scenes.py (street-1, ...): streets,
flights, photographs round a table and walks that no constant was tuned on. "faults" means films of redkitchen with a planted fault
(faults:cut, ...): their ATE shows wrong poses, and the note has the warnings that name frames. "encodings" means
hololens and street as JPEG of several qualities, darker or smaller (street:q80, ...); they need python3-opencv. Runs of
one sequence use the seeds 1, 2, 3, ...
"""
import argparse
import json
import math
import random
import re
import shutil
import sqlite3
import statistics
import struct
import subprocess
import sys
import time
import zlib
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
GAP = range(400, 461)  # frames of redkitchen that are black in "gap"
STRIDES = [("redkitchen", 10), ("redkitchen", 15), ("redkitchen", 20), ("tsukuba", 6), ("blender_desk_a", 10)]
SHUFFLED = {"redkitchen": 15, "tsukuba": 6, "blender_desk_a": 10}  # every so many frames, in random order
FAULTS = ["cut", "freeze", "mixed", "splice"]  # planted into the first 400 frames of redkitchen, see planted()
FOOTAGE = ["hololens", "street", "brighton", "lund", "motorway", "robot"]
ENCODINGS = {"hololens": ["q85", "dark", "w480"], "street": ["q95", "q92", "q80", "q60", "half"]}
SCENES = [f"{kind}-{seed}" for kind in ("street", "bend", "flight", "orbit", "hall") for seed in (1, 2, 3)]
ENCODED = [f"{name}:{encoding}" for name, encodings in ENCODINGS.items() for encoding in encodings]
FPS = 30.0
SAMPLE_INTERVAL = 1.0  # s, between two looks at a run's memory


# --- Sequences -----------------------------------------------------------------------------------------------


def read_rows(path):
    """Lists of words of a text file's lines, comments left out."""
    if not path.exists():
        return []
    lines = path.read_text().splitlines()
    return [line.split() for line in lines if line.strip() and not line.startswith("#")]


def by_frame(rows, images):
    """Rows of a file with timestamps, grouped by the frame that has the same time: index -> list of rows."""
    frame_of = {round(float(row[0]) * 1000): i for i, row in enumerate(images)}
    groups = {}
    for row in rows:
        frame = frame_of.get(round(float(row[0]) * 1000))
        if frame is not None:
            groups.setdefault(frame, []).append(row)
    return groups


def black_png(width, height):
    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    pixels = zlib.compress(bytes((3 * width + 1) * height))
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", pixels) + chunk(b"IEND", b"")


def write_variant(source, target, order, black=()):
    """A sequence folder that shows the frames `order` of another one, 30 a second; those in `black` as black."""
    images = read_rows(source / "rgb.txt")
    poses = by_frame(read_rows(source / "groundtruth.txt"), images)
    boxes = by_frame(read_rows(source / "boxes.txt"), images)
    target.mkdir(parents=True, exist_ok=True)
    shutil.copy(source / "camera.yaml", target)
    if black:
        (target / "black.png").write_bytes(black_png(640, 480))
    rgb, truth, detections = [], [], []
    for i, frame in enumerate(order):
        stamp = f"{i / FPS:.6f}"
        is_black = frame in black
        rgb.append(f"{stamp} {'black.png' if is_black else source.resolve() / images[frame][1]}\n")
        truth += [" ".join([stamp] + row[1:]) + "\n" for row in poses.get(frame, [])]
        detections += [] if is_black else [" ".join([stamp] + row[1:]) + "\n" for row in boxes.get(frame, [])]
    (target / "rgb.txt").write_text("".join(rgb))
    (target / "groundtruth.txt").write_text("".join(truth))
    (target / "boxes.txt").write_text("".join(detections))
    return target


def write_encoding(source, target, encoding):
    """The images of a folder encoded again: JPEG of a quality, 20 % darker, 480 px wide, or at half size."""
    if (target / "camera.yaml").exists():
        return target
    import cv2

    images = read_rows(source / "rgb.txt")
    width = cv2.imread(str(source / images[0][1])).shape[1]
    scale = {"w480": 480 / width, "half": 0.5}.get(encoding, 1.0)
    suffix = ".jpg" if encoding.startswith("q") else ".png"
    target.mkdir(parents=True)
    for stamp, name in images:
        image = cv2.imread(str(source / name))
        if encoding == "dark":
            image = cv2.convertScaleAbs(image, alpha=0.8)
        if scale != 1.0:
            image = cv2.resize(image, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
        quality = [cv2.IMWRITE_JPEG_QUALITY, int(encoding[1:])] if suffix == ".jpg" else []
        cv2.imwrite(str(target / f"{stamp}{suffix}"), image, quality)
    (target / "rgb.txt").write_text("".join(f"{stamp} {stamp}{suffix}\n" for stamp, _ in images))
    shutil.copy(source / "groundtruth.txt", target)
    camera = (source / "camera.yaml").read_text()
    for key in ("width", "height"):
        camera = re.sub(rf"\b({key}: *)(\d+)", lambda m: f"{m[1]}{round(int(m[2]) * scale)}", camera)
    for key in ("fx", "fy"):
        camera = re.sub(rf"\b({key}: *)([\d.]+)", lambda m: f"{m[1]}{float(m[2]) * scale}", camera)
    for key in ("cx", "cy"):
        camera = re.sub(rf"\b({key}: *)([\d.]+)", lambda m: f"{m[1]}{(float(m[2]) + 0.5) * scale - 0.5}", camera)
    (target / "camera.yaml").write_text(camera)  # last: a folder that has it is complete
    return target


def turning_waypoints(turns):
    """Waypoints of a camera that goes round in the middle of the bundled room and looks at its walls."""
    text = ""
    for step in range(12 * turns + 3):
        x, y = -math.sin(step * math.pi / 6), math.cos(step * math.pi / 6)
        height = 1.2 + 0.05 * math.sin(step * math.pi / 3 + 0.2 * step)
        text += f"    - {{position: [{0.7 * x:.3f}, {0.7 * y - 1.3:.3f}, {height:.3f}], "
        text += f"look_at: [{2.2 * x:.3f}, {2.2 * y - 1.3:.3f}, 1.05]}}\n"
    return text


def write_room(arguments, target, alike):
    """A sequence folder of the bundled room from its middle; `alike`: with one poster in all places on one plaster."""
    if (target / "rgb.txt").exists():
        return target
    scene = (ROOT / "assets/scenes/desk.yaml").read_text()
    scene = re.sub(r"(  waypoints:\n)(?:    - .*\n)+", lambda m: m[1] + turning_waypoints(2), scene)
    scene = re.sub(r"^frames: .*", "frames: 560", scene, flags=re.M)
    if alike:
        for pattern in ("poster", "plaster"):  # all like the first
            texture = re.search(rf"texture: {{pattern: {pattern},.*}}", scene)[0]
            scene = re.sub(rf"texture: {{pattern: {pattern},.*}}", texture.replace("\\", r"\\"), scene)
        scene = re.sub(r"u: (.*), v: (.*), (shading_step: .*\n.*pattern: poster)",
                       lambda m: f"u: {resized(m[1], 0.8)}, v: {resized(m[2], 1.0)}, {m[3]}", scene)
    target.parent.mkdir(parents=True, exist_ok=True)
    file = target.with_suffix(".yaml")
    file.write_text(scene)
    subprocess.run([arguments.sqslam, "synth", file, "--output", target, "--quiet"], check=True)
    return target


def resized(vector, length):
    """A vector of a scene's text with another length."""
    values = json.loads(vector)
    return json.dumps([round(length * value / math.hypot(*values), 4) for value in values])


def planted(fault, count):
    """Frame numbers of a film of `count` frames with a fault in its middle."""
    order, middle, third = list(range(count)), count // 2, count // 3
    if fault == "cut":
        return order[:third] + order[2 * third:]
    if fault == "freeze":
        return order[:middle] + [middle] * 60 + order[middle:]
    if fault == "mixed":
        part = order[middle:middle + 30]
        random.Random(7).shuffle(part)
        return order[:middle] + part + order[middle + 30:]
    return order[:count // 4] + order[3 * count // 4:3 * count // 4 + 20] + order[count // 4 + 20:]  # splice


def there_and_back(count, laps):
    """Frame numbers of a walk along a path of `count` frames, every other time from its end."""
    order = list(range(count))
    for lap in range(1, laps):
        order += range(count - 2, -1, -1) if lap % 2 else range(1, count)
    return order


def make_sequences(arguments):
    """Name -> folder. Sequences of an earlier call are used again."""
    data, work = arguments.data, arguments.work / "sequences"
    folders = {name: data / name for name in ("redkitchen", "tsukuba", "blender_desk_a")}
    if folders["redkitchen"].exists():
        count = len(read_rows(folders["redkitchen"] / "rgb.txt"))
        forth = list(range(count))
        folders["twice"] = write_variant(folders["redkitchen"], work / "twice", forth + forth[::-1])
        folders["gap"] = write_variant(folders["redkitchen"], work / "gap", forth, GAP)
    if "laps" in arguments.only:
        desk = work / "desk"
        if not (desk / "rgb.txt").exists():
            scene = ROOT / "assets/scenes/desk.yaml"
            subprocess.run([arguments.sqslam, "synth", scene, "--output", desk, "--noise", "--quiet"], check=True)
        count = len(read_rows(desk / "rgb.txt"))
        folders["laps"] = write_variant(desk, work / "laps", there_and_back(count, arguments.laps))
    for name in ("turns", "alike"):
        if name in arguments.only:
            folders[name] = write_room(arguments, work / name, name == "alike")
    for name, stride in STRIDES:
        folders[f"{name}:{stride}"] = data / name
    for name, stride in SHUFFLED.items():
        if f"{name}:shuffled" in arguments.only and folders[name].exists():
            order = list(range(0, len(read_rows(folders[name] / "rgb.txt")), stride))
            random.Random(1).shuffle(order)
            folders[f"{name}:shuffled"] = write_variant(folders[name], work / f"{name}-shuffled", order)
    for fault in FAULTS:
        if f"faults:{fault}" in arguments.only and folders["redkitchen"].exists():
            order = planted(fault, 400)
            folders[f"faults:{fault}"] = write_variant(folders["redkitchen"], work / f"faults-{fault}", order)
    for name, encoding in (name.split(":") for name in ENCODED if name in arguments.only):
        source = data / "footage" / name
        if source.exists():
            folders[f"{name}:{encoding}"] = write_encoding(source, work / f"{name}-{encoding}", encoding)
    for kind, seed in (name.split("-") for name in SCENES if name in arguments.only):
        command = [ROOT / "scripts/make-scenes.py", work, "--kinds", kind, "--seeds", f"{seed}:{int(seed) + 1}"]
        subprocess.run(command + ["--sqslam", arguments.sqslam], check=True)
        folders[f"{kind}-{seed}"] = work / f"{kind}-{seed}"
    folders |= {name: data / "footage" / name for name in FOOTAGE}
    return {name: folder for name, folder in folders.items() if folder.exists() and name in arguments.only}


# --- Runs ----------------------------------------------------------------------------------------------------


def resident_mib(pid):
    try:
        for line in Path(f"/proc/{pid}/status").read_text().splitlines():
            if line.startswith("VmRSS:"):
                return int(line.split()[1]) / 1024
    except (FileNotFoundError, ProcessLookupError):
        pass
    return None


def newest_frame(recording):
    """Frame of the newest snapshot of a run that may still go on."""
    try:
        database = sqlite3.connect(f"file:{recording}?mode=ro", uri=True)
        try:
            return database.execute("SELECT max(frame_index) FROM snapshots").fetchone()[0]
        finally:
            database.close()
    except sqlite3.Error:
        return None


def run(arguments, name, sequence, output, seed):
    """Runs once; returns memory over time as (frame, MiB), or None where the run failed."""
    shutil.rmtree(output, ignore_errors=True)
    output.parent.mkdir(parents=True, exist_ok=True)
    command = [arguments.sqslam, "run", sequence, "--output", output, "--no-render", "--quiet"]
    command += ["--seed", str(seed)] + (["--stride", name.split(":")[1]] if name.split(":")[-1].isdigit() else [])
    process = subprocess.Popen(command + arguments.options, stderr=subprocess.DEVNULL)
    memory = []
    while process.poll() is None:
        frame, resident = newest_frame(output / "map.sqmap"), resident_mib(process.pid)
        if frame is not None and resident is not None:
            memory.append((frame, resident))
        time.sleep(SAMPLE_INTERVAL)
    return memory if process.returncode == 0 else None


def history(arguments, output):
    """Snapshots of a run as (frame, keyframes, points)."""
    command = [arguments.sqslam, "info", "--history", output]
    lines = subprocess.run(command, check=True, capture_output=True, text=True).stdout.splitlines()[1:]
    return [(int(words[0]), int(words[2]), int(words[3])) for words in map(str.split, lines)]


def measure(arguments, name, sequence, output, seed):
    """All figures of one run, by column; None where the run made no map."""
    memory = run(arguments, name, sequence, output, seed)
    if memory is None:
        return None
    stats = json.loads((output / "stats.json").read_text())
    trajectory = {"ate_rmse": math.nan, "ate_share_of_path": math.nan}
    if (sequence / "groundtruth.txt").exists():
        subprocess.run([arguments.sqslam, "eval", output, "--ground-truth", sequence, "--quiet"], check=True)
        trajectory = json.loads((output / "eval.json").read_text())["trajectory"]
    timing = stats["timing_ms"]
    tracking = timing["tracking"]
    objects = timing.get("tracking.objects", {"mean": 0.0, "count": 0})
    without_objects = tracking["mean"] - objects["mean"] * objects["count"] / tracking["count"]
    figures = {
        "tracked %": 100.0 * stats["tracked"] / stats["frames"],
        "ATE mm": 1000.0 * trajectory["ate_rmse"],
        "ATE % of path": 100.0 * trajectory["ate_share_of_path"],
        "keyframes": stats["keyframes"],
        "points": stats["points"],
        "losses": stats["losses"],
        "reloc.": stats["relocalisations"],
        "loops": stats["loops"],
        "merges": stats["merges"],
        "submaps": stats["submaps"],
        "placed at the end": stats["placed_at_end"],
        "tracking ms": tracking["mean"],
        "without objects": without_objects,
        "p95": tracking["p95"],
        "BA ms": timing.get("mapping.bundle_adjustment", {"mean": 0.0})["mean"],
        "peak MiB": stats["peak_memory_mib"],
    }
    figures["note"] = notes(arguments, name, output, memory)
    return figures


def notes(arguments, name, output, memory):
    """Figures that only some sequences have, by name."""
    snapshots = history(arguments, output)
    if name.startswith("faults:"):
        warnings = json.loads((output / "stats.json").read_text()).get("warnings", [])
        return {"warnings that name frames": sum(" frame " in warning for warning in warnings)}
    if name == "twice":
        half = snapshots[-1][0] / 2
        first = [points for frame, _, points in snapshots if frame <= half][-1]
        return {"points grown in the second half, %": 100.0 * (snapshots[-1][2] / first - 1.0)}
    if name == "gap":
        # The first keyframe after it: frames that are found later, going backward, become no keyframes.
        return {"frames until tracking is back": min(f for f, _, _ in snapshots if f > GAP[-1]) - GAP[-1]}
    if name == "laps":
        write_laps(arguments, output, snapshots, memory)
        lap = snapshots[-1][0] / arguments.laps

        def middle(rows, column, ended):  # of the lap that ended so many laps before the end
            inside = [row[column] for row in rows if arguments.laps - 1 <= row[0] / lap + ended <= arguments.laps]
            return statistics.median(inside)

        return {
            "points, last lap against the one before, %": 100.0 * (
                middle(snapshots, 2, 0) / middle(snapshots, 2, 1) - 1.0
            ),
            "MiB, last lap less the one before": middle(memory, 1, 0) - middle(memory, 1, 1),
        }
    return {}


def write_laps(arguments, output, snapshots, memory):
    """growth.txt and memory.txt beside the result, and a picture of both where gnuplot is there."""
    growth, resident = output / "growth.txt", output / "memory.txt"
    growth.write_text("# frame keyframes points\n" + "".join("%d %d %d\n" % s for s in snapshots))
    resident.write_text("# frame MiB\n" + "".join("%d %.1f\n" % m for m in memory))
    if not shutil.which("gnuplot"):
        return
    lap = snapshots[-1][0] / arguments.laps
    script = f"""
set terminal pngcairo size 1000,900 font 'DejaVu Sans,11'
set output '{output / "memory.png"}'
set multiplot layout 3,1
set grid
set lmargin 8
set key off
set xtics {lap}
set format x ''
set yrange [0:*]
set title 'resident memory, MiB'
plot '{resident}' with lines lw 2
set title 'map points'
plot '{growth}' using 1:3 with lines lw 2
set title 'keyframes'
set format x '%.0f'
set xlabel 'frame (one tic a lap)'
plot '{growth}' using 1:2 with lines lw 2
"""
    subprocess.run(["gnuplot"], input=script, text=True, check=True)


# --- Table ---------------------------------------------------------------------------------------------------


def spread(values):
    """Median, and lowest to highest where they differ."""

    def number(value):
        if float(value).is_integer() or abs(value) >= 100:
            return f"{value:.0f}"
        return f"{value:.3g}"

    low, high = number(min(values)), number(max(values))
    return number(statistics.median(values)) + (f" ({low} to {high})" if low != high else "")


def print_row(name, results):
    done = [figures for figures in results if figures is not None]
    if not done:
        print(f"| {name} | no map in {len(results)} runs |")
        return
    columns = [column for column in done[0] if column != "note"]
    extra = [f"{key}: {spread([f['note'][key] for f in done])}" for key in done[0]["note"]]
    failed = [f"no map in {len(results) - len(done)} of {len(results)} runs"] if len(done) < len(results) else []
    cells = [spread([figures[column] for figures in done]) for column in columns]
    print("| " + " | ".join([name] + cells + ["; ".join(extra + failed)]) + " |", flush=True)


def print_header(columns):
    print("| " + " | ".join(["sequence"] + columns + ["notes"]) + " |")
    print("|" + " --- |" * (len(columns) + 2), flush=True)


def parse_arguments():
    plain = ["redkitchen", "twice", "gap", "tsukuba", "blender_desk_a", "laps"]
    strides = [f"{name}:{stride}" for name, stride in STRIDES]
    shuffled = [f"{name}:shuffled" for name in SHUFFLED]
    faults = [f"faults:{fault}" for fault in FAULTS]
    names = plain + strides + ["strides", "turns", "alike", "footage", "faults", "scenes", "encodings"]
    names += shuffled + FOOTAGE + faults + SCENES + ENCODED
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("data", type=Path, help="folder that holds the sequence folders")
    parser.add_argument("work", type=Path, help="folder for variants and results")
    parser.add_argument("--sqslam", type=Path, default=ROOT / "build/release/bin/sqslam", help="the program")
    parser.add_argument("--runs", type=int, default=5, help="of each sequence (default: %(default)s)")
    parser.add_argument("--laps", type=int, default=10, help="around the desk (default: %(default)s)")
    parser.add_argument("--only", nargs="+", choices=names, default=plain, metavar="NAME",
                        help=f"sequences: {', '.join(names)} (default: the first {len(plain)})")
    parser.add_argument("options", nargs="*", help="options of sqslam run, after --")
    arguments = parser.parse_intermixed_args()  # else options after --only and its names are refused
    groups = {"strides": strides + shuffled, "faults": faults, "footage": FOOTAGE, "scenes": SCENES,
              "encodings": ENCODED}
    arguments.only = [name for group in arguments.only for name in groups.get(group, [group])]
    return arguments


def main():
    arguments = parse_arguments()
    sequences = make_sequences(arguments)
    if not sequences:
        sys.exit(f"measure-slam: {arguments.data}: holds none of the sequences asked for")
    headed = False
    for name in arguments.only:
        if name not in sequences:
            print(f"measure-slam: {name} is not there, left out", file=sys.stderr)
            continue
        results = []
        for i in range(arguments.runs):
            output = arguments.work / "runs" / f"{name.replace(':', '-')}-{i + 1}"
            results.append(measure(arguments, name, sequences[name], output, i + 1))
            figures = results[-1]
            if figures and not headed:
                print_header([column for column in figures if column != "note"])
                headed = True
        print_row(name, results)


if __name__ == "__main__":
    main()
