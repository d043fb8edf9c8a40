#!/usr/bin/python3
"""Maps the same pictures from every kind of file, and compares what comes out with the true pictures and poses.

Each row of the table is a kind of file, each column a command. A cell is right if colours are within 2 grey levels (3 in
points and meshes), times within half a frame and poses within 2 % of the way, or if the command ends with one line that
says why the file cannot be used and with exit code 3.

usage: input_matrix.py PROGRAM FOLDER [KIND...] [--all] [--detector FILE.yaml]
"""
import argparse
import functools
import os
import pathlib
import re
import shutil
import subprocess
import sys
import time

import numpy as np

sys.dont_write_bytecode = True
import model_readers
from chart_room import FPS, Camera, Room
from input_files import FILMS, IMAGES, read_image, write_film, write_images

FRAMES = 40
LEVELS, CLOUD_LEVELS = 2.5, 3.5  # grey levels, with half of one for rounding
WRITTEN_LEVELS = 6  # of single pixels in JPEG files, at borders
OVERSHOOT = 0.15  # of the contrast: small images are enlarged by bicubic interpolation before they are mapped
FULL_CHROMA = ("png-8", "tiff", "webp", "bt709-all-colours")  # files in which every pixel has its own colour
FISHEYE = (-0.02, 0.004, -0.003, 0.0005)


class Wrong(Exception):
    """A cell that is not as it should be."""


def expect(condition, message):
    if not condition:
        raise Wrong(message)


def tool(*arguments):
    """Runs one of COLMAP's programs."""
    done = subprocess.run(["colmap", *map(str, arguments)], capture_output=True, text=True,
                          env=dict(os.environ, QT_QPA_PLATFORM="offscreen"))
    expect(done.returncode == 0, f"colmap {arguments[0]}: {(done.stdout + done.stderr)[-300:]}")
    return done.stdout + done.stderr


def overlap(a, b):
    """Intersection over union of two rows of boxes.txt."""
    (ax, ay, aw, ah), (bx, by, bw, bh) = (map(float, row[3:7]) for row in (a, b))
    shared = max(0, min(ax + aw, bx + bw) - max(ax, bx)) * max(0, min(ay + ah, by + bh) - max(ay, by))
    return shared / (aw * ah + bw * bh - shared)


def similarity(source, target):
    """Scale, rotation and translation from source to target points, after Umeyama."""
    a, b = source - source.mean(axis=0), target - target.mean(axis=0)
    u, d, v = np.linalg.svd(b.T @ a)
    sign = np.diag([1, 1, np.sign(np.linalg.det(u @ v))])
    rotation = u @ sign @ v
    scale = np.trace(np.diag(d) @ sign) / (a ** 2).sum()
    return scale, rotation, target.mean(axis=0) - scale * rotation @ source.mean(axis=0)


def fits(color, view, x, y):
    """True if the colour lies between those around the pixel of the written image."""
    return lies_between(color, view.image, x, y, WRITTEN_LEVELS)


def lies_between(color, image, x, y, tolerance):
    column, row = int(x), int(y)
    near = image[max(0, row - 1):row + 2, max(0, column - 1):column + 2].reshape(-1, 3).astype(int)
    low, high = near.min(axis=0), near.max(axis=0)
    tolerance = tolerance + OVERSHOOT * (high - low)
    return ((color >= low - tolerance) & (color <= high + tolerance)).all()


class Kind:
    """A kind of file, made in its folder, and what the commands make of it."""

    def __init__(self, name, room, program, folder, options=(), detector=None):
        self.name, self.room, self.program, self.folder = name, room, program, folder
        self.options, self.detector = list(options), detector
        self.is_film = name in FILMS
        write = write_film if self.is_film else write_images
        self.input, self.frames = write(name, room, folder / "input")
        self.result = folder / "map"

    def sqslam(self, *arguments):
        return subprocess.run([str(self.program), *map(str, arguments)], capture_output=True, text=True)

    def make(self, *arguments):
        done = self.sqslam(*arguments)
        expect(done.returncode == 0, f"{arguments[0]} ends with {done.returncode}: {done.stderr.strip()[-300:]}")
        return done.stdout + done.stderr

    # ---- Columns

    def run(self):
        arguments = ["run", self.input, "--camera", self.folder / "input/camera.yaml", "--no-render", "--deterministic",
                     "--detector", "none", "--output", self.result, *self.options]
        if self.frames == []:
            done = self.sqslam(*arguments)
            lines = [line for line in done.stderr.splitlines() if line.strip()]
            expect(done.returncode == 3 and len(lines) == 1 and self.input.name in lines[0],
                   f"exit code {done.returncode}: {done.stderr.strip()}")
            return lines[0].replace(str(self.input), self.input.name)
        self.make(*arguments)
        rows = [line.split() for line in (self.result / "trajectory.txt").read_text().splitlines() if line[0] != "#"]
        first = self.first()
        numbers = [int(round(float(row[0]) * FPS)) + first for row in rows]
        count = len(self.frames) if self.frames else self.room.count - first
        expect(len(rows) >= 0.9 * count, f"{len(rows)} of {count} frames have a pose")
        off = max(abs(float(row[0]) * FPS + first - number) for row, number in zip(rows, numbers))
        expect(off < 0.5 and max(numbers) < self.room.count, "times are not those of the pictures")
        if self.frames:
            expect(set(numbers) <= set(self.frames), "times of pictures that were dropped")
        seen = np.array([row[1:4] for row in rows], float)
        true = np.array([self.room.poses[i][1] for i in numbers])
        scale, rotation, shift = similarity(seen, true)
        error = np.sqrt((np.linalg.norm(seen @ rotation.T * scale + shift - true, axis=1) ** 2).mean())
        way = np.linalg.norm(np.diff(true, axis=0), axis=1).sum()
        expect(error < 0.02 * way, f"the path is off by {100 * error / way:.1f} % of its length")
        return f"{len(rows)} poses, {100 * error / way:.2f} %"

    def detect(self):
        """The network sees in the pictures what it sees in a lossless copy of them."""
        if self.detector is None:
            return "left out: no detector is given"
        reference = self.folder.parent / "reference"
        if not reference.exists():
            write_images("png-8", self.room, reference)
            self.boxes(reference, reference / "boxes.txt")
        self.boxes(self.input, self.folder / "boxes.txt")
        expected, seen = ([line.split() for line in (folder / "boxes.txt").read_text().splitlines() if line[0] != "#"]
                          for folder in (reference, self.folder))
        expected = [row for row in expected if float(row[2]) > 0.05]
        found = sum(any(row[:2] == other[:2] and overlap(row, other) > 0.7 for other in seen) for row in expected)
        expect(found >= 0.6 * len(expected) > 0, f"{found} of {len(expected)} boxes are found again")
        return f"{found} of {len(expected)} boxes"

    def boxes(self, images, file):
        self.make("detect", images, "--detector", self.detector, "--set", "threshold=0.03", "--frames", 2, "--stride", 20,
                  "--output", file)

    @functools.cache
    def first(self):
        """The number of the first picture: for a cut film it is told by the content."""
        if self.frames:
            return self.frames[0]
        return self.room.nearest(self.overlaid(0))

    def overlaid(self, frame):
        file = self.folder / f"overlay-{frame}.png"
        if not file.exists():
            self.make("render", self.result, "--camera-frame", frame, "--overlay", "--output", file, "--resolution",
                      f"{self.room.camera.width},{self.room.camera.height}")
        return read_image(file)

    def overlay(self):
        worst = 0.0
        count = len(self.frames) if self.frames else self.room.count - self.first()
        for frame in (0, count // 2, count - 1):
            number = self.frames[frame] if self.frames else self.first() + frame
            image = self.overlaid(frame)
            expect(image.shape == self.room.pictures[0].shape, f"the overlay has the shape {image.shape}")
            expect(self.room.nearest(image) == number, f"frame {frame} shows picture {self.room.nearest(image)}")
            worst = max(worst, self.room.error(image, number))
        expect(worst < CLOUD_LEVELS if self.is_film else worst < LEVELS, f"colours are off by {worst:.0f}")
        return f"{worst:.0f}"

    def check_views(self, views):
        """The written images are the true pictures, at the times and places of the keyframes. Returns their numbers."""
        keyframes = [line.split() for line in (self.result / "keyframes.txt").read_text().splitlines() if line[0] != "#"]
        places = np.array([row[1:4] for row in keyframes], float)
        expect(len(views) == len(keyframes), f"{len(views)} images of {len(keyframes)} keyframes")
        numbers, worst = [], 0.0
        for view in views:
            distances = np.linalg.norm(places - view.center, axis=1)
            expect(distances.min() < 1e-4, "an image without keyframe")
            image = read_image(view.file)
            expect(image.shape == (view.lens.height, view.lens.width, 3), f"{view.file.name} has the shape {image.shape}")
            expect(image.shape == self.room.pictures[0].shape, f"the images have the shape {image.shape}")
            number = self.room.nearest(image)
            seconds = float(keyframes[int(distances.argmin())][0])
            expect(abs(seconds + (self.first() - number) / FPS) < 0.5 / FPS,
                   f"picture {number} has the time {seconds} s, the first is {self.first()}")
            numbers.append(number)
            view.image = image.astype(int)
            worst = max(worst, self.room.error(image, number))
        expect(worst < LEVELS, f"colours are off by {worst:.0f}")
        return numbers, worst

    def check_points(self, points, colors, views, numbers):
        """Points that lie in tiles of one colour have it; the room is convex, so nothing hides them."""
        differences = []
        for view, number in zip(views, numbers):
            pixels, ahead = view.project(points)
            at = np.floor(pixels[ahead]).astype(int)
            flat = self.room.flat[number][at[:, 1], at[:, 0]] >= 0
            true = self.room.pictures[number][at[:, 1], at[:, 0]].astype(float)
            differences.append(np.abs(colors[ahead][flat] - true[flat]).max(axis=1))
        differences = np.concatenate(differences)
        expect(len(differences) > 100, f"{len(differences)} points in tiles")
        off = float(np.quantile(differences, 0.9))
        expect(off < CLOUD_LEVELS, f"the colours of points are off by {off:.0f}")
        return off

    def colmap(self):
        printed = self.make("export", self.result, "--format", "colmap", "--output", self.folder / "colmap")
        views, points, colors, tracks, error = model_readers.read_colmap(self.folder / "colmap")
        numbers, worst = self.check_views(views)
        if self.name in FULL_CHROMA and not self.options:  # a resized image has mixed colours, an enlarged one some
            true = {view: self.room.pictures[number] for view, number in zip(views, numbers)}
            off = sum(not any(lies_between(color, true[view], x, y, CLOUD_LEVELS) for view, x, y in track)
                      for color, track in zip(colors, tracks))
            expect(off <= 0.15 * len(points), f"{off} of {len(points)} points do not have the true colours")
        wrong = sum(not any(fits(color, view, x, y) for view, x, y in track)
                    for color, track in zip(colors, tracks))
        expect(wrong <= 0.12 * len(points), f"{wrong} of {len(points)} points have colours that are not at their keypoints")
        ours = float(re.search(r"([\d.]+) (?:px|pixels)", printed).group(1))
        expect(abs(ours - error) < 0.01, f"reprojection error {error:.3f} px, {ours} px printed")
        return f"{worst:.0f}, {error:.2f} px"

    def colmap_tools(self):
        """COLMAP's programs accept the model, and agree on its error; their own points fit our poses as well."""
        if not shutil.which("colmap"):
            return "left out: colmap is not installed"
        folder, model = self.folder / "colmap", self.folder / "colmap/sparse/0"
        _, _, _, _, ours = model_readers.read_colmap(folder)
        theirs = self.analyzed(model)
        expect(abs(theirs - ours) < 0.01, f"reprojection error {ours:.3f} px, {theirs} px by COLMAP")
        tool("image_undistorter", "--image_path", folder / "images", "--input_path", model, "--output_path",
             self.folder / "undistorted")
        written = {file.name for file in (self.folder / "undistorted/images").rglob("*") if file.is_file()}
        expect(written == {file.name for file in (folder / "images").rglob("*") if file.is_file()}, f"undistorted: {written}")
        (row,) = model_readers.rows(model / "cameras.txt")
        database, triangulated = self.folder / "features.db", self.folder / "triangulated"
        names = self.folder / "names.txt"
        names.write_text("".join(f"{row[9]}\n" for row in model_readers.rows(model / "images.txt")[::2]))
        tool("feature_extractor", "--SiftExtraction.use_gpu", 0, "--SiftExtraction.num_threads", 2,
             "--ImageReader.single_camera", 1, "--database_path", database, "--image_path", folder / "images",
             "--image_list_path", names, "--ImageReader.camera_model", row[1], "--ImageReader.camera_params",
             ",".join(row[4:]))
        tool("sequential_matcher", "--SiftMatching.use_gpu", 0, "--SiftMatching.num_threads", 2, "--database_path", database)
        triangulated.mkdir()
        tool("point_triangulator", "--clear_points", 1, "--database_path", database, "--image_path", folder / "images",
             "--input_path", model, "--output_path", triangulated)
        own = self.analyzed(triangulated)
        expect(own < 1.5 * ours + 0.1, f"COLMAP's points have an error of {own} px, ours {ours:.3f} px")
        return f"{theirs:.2f} px, own points {own:.2f} px"

    def analyzed(self, model):
        printed = tool("model_analyzer", "--path", model)
        return float(re.search(r"Mean reprojection error: ([\d.]+)px", printed).group(1))

    def nerfstudio(self):
        self.make("export", self.result, "--format", "nerfstudio", "--output", self.folder / "nerf")
        views, (points, colors) = model_readers.read_nerfstudio(self.folder / "nerf")
        _, worst = self.check_views(views)
        fitting = []
        for view in views:
            pixels, ahead = view.project(points)
            fitting += [fits(color, view, *pixel) for color, pixel in zip(colors[ahead], pixels[ahead])]
        share = np.mean(fitting)
        expect(share > 0.8, f"only {100 * share:.0f} % of the points have the colours of the pixels where they are")
        return f"{worst:.0f}, {100 * share:.0f} %"

    def densify(self):
        self.make("densify", self.result)
        views, _ = model_readers.read_nerfstudio(self.folder / "nerf")
        numbers = [self.room.nearest(read_image(view.file)) for view in views]
        cloud = self.check_points(*model_readers.read_ply(self.result / "dense.ply"), views, numbers)
        mesh = self.check_points(*model_readers.read_glb(self.result / "dense.glb"), views, numbers)
        return f"{cloud:.0f}, mesh {mesh:.0f}"


FILM_COLUMNS = ("run", "overlay", "colmap", "nerfstudio", "densify")
IMAGE_COLUMNS = FILM_COLUMNS + ("detect",)
MODEL_COLUMNS = ("run", "colmap", "nerfstudio", "colmap_tools")
# Sources of models for COLMAP's programs: the kind of file, options of the run, and the lens.
SOURCES = {"resized": ("png-8", ["--resize", "0.75"], None), "fisheye": ("png-8", [], FISHEYE)}
QUICK = ("jpeg-6", "png-12-in-16", "bt709-all-colours", "ts-cut-0.37", "audio-only", "fisheye")  # in ctest


def rows_of(arguments):
    """Kinds with their columns."""
    kinds = arguments.kinds or (list(IMAGES) + list(FILMS) + list(SOURCES) if arguments.all else QUICK)
    size = {"width": 320, "height": 240}
    room = Room(Camera(**size, focal=260.0), FRAMES)
    program, folder = arguments.program.resolve(), arguments.folder
    for name in kinds:
        files, options, lens = SOURCES.get(name, (name, [], None))
        shown = Room(Camera(**size, focal=200.0, fisheye=lens), FRAMES) if lens else room
        kind = Kind(files, shown, program, folder / name, options, arguments.detector)
        columns = MODEL_COLUMNS if name in SOURCES else FILM_COLUMNS if kind.is_film else IMAGE_COLUMNS
        if name in ("png-8", "jpeg-6", "h264"):
            columns += ("colmap_tools",)
        yield name, kind, ("run",) if kind.frames == [] else columns


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", type=pathlib.Path)
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("kinds", nargs="*")
    parser.add_argument("--all", action="store_true")
    parser.add_argument("--detector", type=pathlib.Path)
    arguments = parser.parse_args()
    shutil.rmtree(arguments.folder, ignore_errors=True)
    failed = 0
    for name, kind, columns in rows_of(arguments):
        for column in columns:
            start = time.time()
            try:
                text = getattr(kind, column)()
            except Wrong as wrong:
                failed += 1
                text = f"WRONG {wrong}"
            print(f"{name:18} {column:12} {text} ({time.time() - start:.1f} s)", flush=True)
    sys.exit(f"{failed} cells are wrong" if failed else 0)


if __name__ == "__main__":
    main()
