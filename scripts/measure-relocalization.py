#!/usr/bin/python3
"""Measures how many images `sqslam localize` finds in a map after the light has changed.

Maps the first half of a sequence. Makes variants of the images of the second half (darker, blurred, of little
contrast), and localizes every N-th image of each alone in that map, without and with the start from the boxes of
mapped objects (tracking.relocalization.objects). Prints a Markdown table of the images found and of their distances
from the truth; poses without truth are only counted. Needs python3-opencv.

    scripts/measure-relocalization.py ../data/redkitchen out/light
"""
import argparse
import concurrent.futures
import pathlib
import shutil
import statistics
import subprocess
import sys

import cv2
import numpy

ROOT = pathlib.Path(__file__).resolve().parent.parent
NOT_FOUND = 4  # exit code of localize where no image is found
GREY = 127.5  # that a change of contrast leaves as it is


def contrast(image, factor):
    return GREY + factor * (image - GREY)


def blur(image, sigma):
    return cv2.GaussianBlur(image, (0, 0), sigma)


VARIANTS = {  # of an image of floats in [0, 255]
    "as they are": lambda image: image,
    "brightness x0.5": lambda image: 0.5 * image,
    "blur of 3 px": lambda image: blur(image, 3.0),
    "contrast x0.25": lambda image: contrast(image, 0.25),
    "contrast x0.25, blur of 3 px": lambda image: contrast(blur(image, 3.0), 0.25),
}


def rows(path):
    """Lists of words of a text file's lines, comments left out."""
    if not path.exists():
        return []
    return [line.split() for line in path.read_text().splitlines() if line.strip() and not line.startswith("#")]


def millisecond(stamp):
    return round(1000.0 * float(stamp))


def centers(path):
    """Camera centres of a trajectory by time in milliseconds."""
    return {millisecond(row[0]): numpy.array([float(v) for v in row[1:4]]) for row in rows(path)}


def write_variant(sequence, target, images, change):
    """Writes a sequence folder of these changed images, with the boxes and the camera of the original."""
    (target / "rgb").mkdir(parents=True)
    shutil.copy(sequence / "camera.yaml", target)
    listed = []
    for stamp, name in images:
        changed = change(cv2.imread(str(sequence / name)).astype(numpy.float32))
        file = pathlib.Path("rgb") / f"{pathlib.Path(name).stem}.png"
        cv2.imwrite(str(target / file), numpy.clip(numpy.rint(changed), 0, 255).astype(numpy.uint8))
        listed.append(f"{stamp} {file}\n")
    (target / "rgb.txt").write_text("".join(listed))
    stamps = {millisecond(stamp) for stamp, _ in images}
    boxes = [row for row in rows(sequence / "boxes.txt") if millisecond(row[0]) in stamps]
    (target / "boxes.txt").write_text("".join(" ".join(row) + "\n" for row in boxes))


def similarity(source, target):
    """The similarity target = s R source + t of least squared distances (Umeyama 1991)."""
    a, b = source - source.mean(0), target - target.mean(0)
    u, d, v = numpy.linalg.svd(b.T @ a)
    sign = numpy.diag([1.0, 1.0, numpy.sign(numpy.linalg.det(u @ v))])
    r = u @ sign @ v
    s = numpy.trace(numpy.diag(d) @ sign) / (a ** 2).sum()
    return s, r, target.mean(0) - s * r @ source.mean(0)


def localize(program, variant, number, result, output, options):
    """The camera centre of one image of a folder in the map's frame, or None."""
    command = [program, "localize", variant, "--map", result, "--frames", f"{number}:{number + 1}", "--output", output]
    done = subprocess.run(command + ["--quiet"] + options, capture_output=True, text=True)
    if done.returncode not in (0, NOT_FOUND):
        sys.exit(f"measure-relocalization: {' '.join(map(str, command))}: {done.stderr[-500:]}")
    found = list(centers(output / "trajectory.txt").values())
    shutil.rmtree(output)
    return found[0] if found else None


def row(name, images, positions, truth, to_world):
    """A table row: how many images were found without and with objects, and how far from the truth."""
    cells = [name, " and ".join(str(sum(p is not None for p in found)) for found in positions) + f" of {len(images)}"]
    s, r, t = to_world
    for found in positions:
        errors = [1e3 * numpy.linalg.norm(s * r @ position + t - truth[millisecond(image[0])])
                  for image, position in zip(images, found) if position is not None and millisecond(image[0]) in truth]
        cells.append(f"{statistics.median(errors):.1f}, {max(errors):.0f} mm" if errors else "")
    return "| " + " | ".join(cells) + " |"


def parse_arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("sequence", type=pathlib.Path, help="a sequence folder with groundtruth.txt and boxes.txt")
    parser.add_argument("work", type=pathlib.Path, help="a new folder for the map and the variants")
    parser.add_argument("--sqslam", type=pathlib.Path, default=ROOT / "build/release/bin/sqslam", help="the program")
    parser.add_argument("--step", type=int, default=10, help="every so many images (default: %(default)s)")
    parser.add_argument("--jobs", type=int, default=2, help="images localized at a time (default: %(default)s)")
    return parser.parse_args()


def main():
    arguments = parse_arguments()
    images = rows(arguments.sequence / "rgb.txt")
    half = len(images) // 2
    result = arguments.work / "map"
    subprocess.run([arguments.sqslam, "run", arguments.sequence, "--frames", str(half), "--output", result,
                    "--no-render", "--quiet", "--detector", "none", "--seed", "1"], check=True)
    truth, mapped = centers(arguments.sequence / "groundtruth.txt"), centers(result / "trajectory.txt")
    common = [stamp for stamp in mapped if stamp in truth]
    to_world = similarity(*(numpy.array([of[stamp] for stamp in common]) for of in (mapped, truth)))
    picked = images[half::arguments.step]
    print("| images | found without and with objects | median, largest error without | with |")
    print("| --- | --- | --- | --- |", flush=True)
    for index, (name, change) in enumerate(VARIANTS.items()):
        variant = arguments.work / f"variant-{index}"
        write_variant(arguments.sequence, variant, picked, change)
        positions = []
        for objects in ("false", "true"):
            options = ["--set", f"tracking.relocalization.objects={objects}"]
            with concurrent.futures.ThreadPoolExecutor(arguments.jobs) as pool:
                positions.append(list(pool.map(
                    lambda number: localize(arguments.sqslam, variant, number, result,
                                            arguments.work / f"found-{number}", options), range(len(picked)))))
        print(row(name, picked, positions, truth, to_world), flush=True)


if __name__ == "__main__":
    main()
