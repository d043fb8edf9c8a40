#!/usr/bin/env python3
"""The Python module on a short run of the desk. usage: module_test.py PROGRAM SOURCES DESK"""
import ast
import contextlib
import html
import json
import os
import pathlib
import re
import shutil
import sqlite3
import subprocess
import sys
import tempfile
import unittest

import sqslam
import numpy as np

PROGRAM, SOURCES, DESK = sys.argv[1], pathlib.Path(sys.argv[2]), pathlib.Path(sys.argv[3])
RESULT = DESK / "result"


def read_poses(name):
    rows = np.loadtxt(RESULT / name)
    return rows[:, 0], rows[:, 1:4]


class Reading(unittest.TestCase):
    def setUp(self):
        self.result = sqslam.read(RESULT)

    def test_poses_are_those_of_the_files(self):
        times, centers = read_poses("keyframes.txt")
        np.testing.assert_allclose(self.result.times, times, atol=1e-6)
        np.testing.assert_allclose(self.result.poses[:, :3, 3], centers, atol=1e-6)
        times, centers = read_poses("trajectory.txt")
        np.testing.assert_allclose(self.result.trajectory[0], times, atol=1e-6)
        np.testing.assert_allclose(self.result.trajectory[1][:, :3, 3], centers, atol=1e-6)
        turns = self.result.trajectory[1][:, :3, :3]
        np.testing.assert_allclose(turns @ turns.transpose(0, 2, 1), np.broadcast_to(np.eye(3), turns.shape), atol=1e-9)

    def test_points_are_those_of_the_file(self):
        data = (RESULT / "points.ply").read_bytes()
        head, body = data.split(b"end_header\n", 1)
        points = np.frombuffer(body, [("p", "<f4", 3), ("rgb", "u1", 3), ("id", "<i4")])
        self.assertIn(f"element vertex {len(points)}\n".encode(), head)
        np.testing.assert_array_equal(self.result.points, points["p"])
        np.testing.assert_array_equal(self.result.colors, points["rgb"])
        np.testing.assert_array_equal(self.result.point_objects, points["id"])
        self.assertEqual(self.result.points.dtype, np.float32)

    def test_objects_are_those_of_the_file(self):
        written = json.loads((RESULT / "objects.json").read_text())["objects"]
        self.assertGreater(len(written), 5)
        self.assertEqual([o.id for o in self.result.objects], [o["id"] for o in written])
        for a, b in zip(self.result.objects, written):
            self.assertEqual((a.label, a.name, a.observations, a.points, a.uncertain),
                             (b["label"], b["label"], b["observations"], b["points"], b["uncertain"]))
            np.testing.assert_allclose(a.half_size, b["half_size"], rtol=1e-6)
            np.testing.assert_allclose(a.shape, b["shape"], rtol=1e-6)
            np.testing.assert_allclose(a.T_map_object, b["T_map_object"], atol=1e-6)
            np.testing.assert_allclose(a.parameters[7], b["yaw"], atol=1e-6)

    def test_every_state_can_be_read(self):
        states = list(self.result)
        self.assertEqual(len(states), len(self.result))
        self.assertGreater(len(states), 3)
        frames = [state.frame for state in states]
        self.assertEqual(frames, sorted(frames))
        self.assertLess(len(states[0].points), len(states[-1].points))
        np.testing.assert_array_equal(states[-1].points, self.result.points)
        np.testing.assert_array_equal(self.result[-1].poses, states[-1].poses)
        self.assertEqual(states[-1].pose.shape, (4, 4))
        with self.assertRaises(IndexError):
            self.result[len(self.result)]

    def test_relations_are_those_of_the_file(self):
        data = json.loads((RESULT / "relations.json").read_text())
        nodes = [n["id"] if n["kind"] == "object" else n["kind"] if n["kind"] == "floor" else f"{n['kind']} {n['id']}"
                 for n in data["nodes"]]
        written = [(nodes[r["subject"]], r["relation"], nodes[r["object"]], r["probability"]) for r in data["relations"]]
        self.assertEqual(self.result.relations, written)
        cups = [o.id for o in self.result.objects if o.label in ("cup", "mug")]
        self.assertEqual(sorted(o.id for o in self.result.query("cups")), sorted(cups))
        with self.assertRaisesRegex(sqslam.UsageError, "not known"):
            self.result.query("cupz")

    def test_distances_vanish_on_surfaces_and_grow_along_gradients(self):
        thing = self.result.objects[0]
        above = thing.center + [0, 0, 3 * thing.half_size[2]]
        distance, gradient = sqslam.distance(thing, [above, thing.center])
        np.testing.assert_allclose(distance[0], 2 * thing.half_size[2], rtol=1e-6)
        self.assertLess(distance[1], 0)
        np.testing.assert_allclose(gradient[0], [0, 0, 1], atol=1e-6)
        nearest, _ = self.result.distance([above])
        self.assertLessEqual(nearest[0], distance[0] + 1e-12)
        self.assertLess(self.result.distance([above], sigmas=3)[0][0], nearest[0] + 1e-12)

    def test_arrays_outlive_the_map(self):
        points = sqslam.read(RESULT)[0].points
        self.assertTrue(np.isfinite(points).all())

    def test_a_relative_path_means_the_same_after_a_change_of_folder(self):
        before = os.getcwd()
        with tempfile.TemporaryDirectory() as folder:
            try:
                os.chdir(RESULT.parent)
                result = sqslam.read(RESULT.name)
                os.chdir(folder)
                times = result.trajectory[0]
            finally:
                os.chdir(before)
        np.testing.assert_array_equal(times, self.result.trajectory[0])

    def test_names_that_are_no_utf8_are_read(self):
        with tempfile.TemporaryDirectory() as folder:
            copy, renamed = pathlib.Path(folder) / "copy", os.fsencode(folder) + b"/caf\xe9"
            shutil.copytree(RESULT, copy)
            with contextlib.closing(sqlite3.connect(copy / "map.sqmap")) as recording, recording:
                recording.execute("UPDATE meta SET value = ? WHERE key = 'sequence_path'", (b"/data/caf\xe9",))
            os.rename(copy, renamed)
            result = sqslam.read(os.fsdecode(renamed))
            self.assertEqual(os.fsencode(result.sequence), b"/data/caf\xe9")
            self.assertIn("<title>caf\ufffd</title>", result.page())
            with self.assertRaisesRegex(sqslam.InputError, "/caf\ufffd/none"):
                sqslam.read(os.fsdecode(renamed + b"/none"))

    def test_what_cannot_be_read_is_named(self):
        with self.assertRaisesRegex(sqslam.InputError, "nowhere"):
            sqslam.read("nowhere")
        self.assertTrue(issubclass(sqslam.InputError, ValueError))


class Solids(unittest.TestCase):
    def test_iou(self):
        moved = np.eye(4)
        moved[0, 3] = 1.0
        a = sqslam.Superquadric((1, 1, 1), (0.1, 0.1))
        self.assertAlmostEqual(sqslam.iou(a, a), 1.0, places=2)
        self.assertAlmostEqual(sqslam.iou(a, sqslam.Superquadric((1, 1, 1), (0.1, 0.1), moved)), 1 / 3, places=2)
        for wrong in ((-1, 1, 1), (0.1, 1.0)), ((1, 1, 1), (3.0, 1.0)):
            with self.assertRaises(sqslam.UsageError):
                sqslam.Superquadric(*wrong)
        with self.assertRaises(sqslam.UsageError):
            sqslam.Superquadric((1, 1, 1), (1, 1), 2 * np.eye(4))

    def test_fit(self):
        directions = np.random.default_rng(1).normal(size=(800, 3))
        ball = 0.3 * directions / np.linalg.norm(directions, axis=1, keepdims=True) + [1, 2, 3]
        fit, = sqslam.fit(ball)
        np.testing.assert_allclose(fit.center, [1, 2, 3], atol=0.005)
        self.assertGreater(sqslam.iou(fit, sqslam.Superquadric((0.3,) * 3, (1, 1), fit.T_map_object)), 0.98)
        self.assertEqual((fit.inliers.shape, fit.inliers.dtype), ((800,), bool))
        self.assertAlmostEqual(fit.volume, 4 / 3 * np.pi * 0.3**3, delta=0.003)
        self.assertEqual(len(sqslam.fit(np.vstack([ball, ball + 2]), clusters=None)), 2)
        for wrong in (ball[:5], ball[:, :2]):
            with self.assertRaises(ValueError):
                sqslam.fit(wrong)


class Pictures(unittest.TestCase):
    def setUp(self):
        self.result = sqslam.read(RESULT)

    def test_a_map_is_drawn_into_an_array(self):
        picture = sqslam.render(self.result, width=320, height=200)
        self.assertEqual((picture.shape, picture.dtype), ((200, 320, 3), np.uint8))
        self.assertGreater(picture.std(), 5)
        np.testing.assert_array_equal(picture, sqslam.render(self.result, width=320, height=200))
        self.assertTrue((picture != sqslam.render(self.result[0], width=320, height=200)).any())
        red = sqslam.render(self.result, width=320, height=200, set=['background="#ff0000"'])[0, 0]
        self.assertGreater(int(red[0]), int(red[2]) + 100)  # red green blue, not the other way round
        clear = sqslam.render(self.result, width=320, height=200, transparent=True, view="top", zoom=0.5)
        self.assertEqual(clear.shape, (200, 320, 4))
        self.assertEqual(clear[0, 0, 3], 0)
        with self.assertRaisesRegex(sqslam.UsageError, "blueprint"):
            sqslam.render(self.result, style="blueprin")
        with self.assertRaises(TypeError):
            sqslam.render(None)
        for wrong in {"zoom": 0.0}, {"azimuth": np.nan}, {"elevation": np.inf}:
            with self.assertRaisesRegex(sqslam.UsageError, next(iter(wrong))):
                sqslam.render(self.result, **wrong)

    def test_a_dense_map_is_drawn_as_a_cloud_or_as_a_mesh(self):
        with tempfile.TemporaryDirectory() as folder:
            dense = pathlib.Path(folder) / "dense"
            shutil.copytree(RESULT, dense)
            subprocess.run([PROGRAM, "densify", dense, "--quiet"], check=True, capture_output=True)
            look = lambda name: sqslam.render(  # noqa: E731
                sqslam.read(dense), width=320, height=200, set=[f"dense_cloud.look={name}"])
            self.assertTrue((look("mesh") != look("points")).any())

    def test_a_notebook_shows_the_page(self):
        with tempfile.TemporaryDirectory() as folder:
            page = pathlib.Path(folder) / "map.html"
            subprocess.run([PROGRAM, "export", RESULT, "--output", page], check=True, capture_output=True)
            self.assertEqual(self.result.page(), page.read_text())
        shown = re.fullmatch(r'<iframe srcdoc="([^"]*)"[^>]*></iframe>', self.result._repr_html_())
        self.assertEqual(html.unescape(shown.group(1)), self.result.page())


class Packaging(unittest.TestCase):
    def test_after_another_vtk_there_is_one_line_and_no_crash(self):
        code = "import ctypes; ctypes.CDLL('libGLEW.so.2.2'); import sqslam"
        run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
        self.assertEqual(run.returncode, 1)
        self.assertIn("ImportError: sqslam: another module has already loaded VTK", run.stderr.splitlines()[-1])

    def test_the_types_name_what_there_is(self):
        stub = ast.parse((pathlib.Path(sqslam.__file__).parent / "__init__.pyi").read_text())
        classes = {node.name: node for node in stub.body if isinstance(node, ast.ClassDef)}
        functions = {node.name for node in stub.body if isinstance(node, ast.FunctionDef)}
        self.assertEqual(set(sqslam.__all__) - {"__version__"}, functions | set(classes) - {"_Map"})

        def members(name):
            found = {node.name for node in classes[name].body if isinstance(node, ast.FunctionDef)}
            found |= {node.target.id for node in classes[name].body if isinstance(node, ast.AnnAssign)}
            return found.union(*(members(base.id) for base in classes[name].bases if base.id in classes))

        for name in functions:
            self.assertTrue(getattr(sqslam, name).__doc__.rstrip().endswith("."), name)
        public = {name for name in classes if name not in ("_Map", "InputError", "UsageError")}
        for name in public:
            there = {member for member in dir(getattr(sqslam, name)) if not member.startswith("_")}
            self.assertEqual({member for member in members(name) if not member.startswith("_")}, there, name)

    def python_of_the_documentation(self):
        page = (SOURCES / "docs" / "library.md").read_text()
        code = "\n".join(re.findall(r"^```python\n(.*?)^```", page, re.DOTALL | re.MULTILINE))
        self.assertIn("sqslam.read", code)
        return code

    @unittest.skipUnless(shutil.which("mypy"), "no mypy: packages-test.txt")
    def test_the_types_suit_the_documentation_and_forbid_what_fails(self):
        def complaints(code):
            with tempfile.TemporaryDirectory() as folder:
                run = subprocess.run(
                    ["mypy", "--strict", "--no-error-summary", f"--cache-dir={folder}", "--python-executable",
                     sys.executable, "-c", code], cwd=folder, capture_output=True, text=True, check=False,
                    env=os.environ | {"MYPYPATH": str(pathlib.Path(sqslam.__file__).parents[1])})
            return run.stdout + run.stderr

        self.assertEqual(complaints(self.python_of_the_documentation()), "")
        self.assertIn("read-only", complaints("import sqslam\nsqslam.read('out').points = sqslam.read('in').points"))

    def test_the_documentation_runs(self):
        code = self.python_of_the_documentation()
        with tempfile.TemporaryDirectory() as folder:
            os.makedirs(f"{folder}/out")
            os.symlink(RESULT, f"{folder}/out/desk")
            subprocess.run([sys.executable, "-W", "error", "-c", code], cwd=folder, check=True, capture_output=True)

    def test_the_documentation_shows_the_examples(self):
        page = (SOURCES / "docs" / "library.md").read_text()
        shown = re.findall(r"^```cpp\n(.*?)^```", page, re.DOTALL | re.MULTILINE)
        plain = lambda text: " ".join(text.split())  # noqa: E731
        files = sorted((SOURCES / "docs" / "examples").glob("*.cpp"))
        self.assertEqual(len(files), 4)
        of = [[path for path in files if plain(block) in plain(path.read_text())] for block in shown]
        self.assertTrue(all(of), [block for block, paths in zip(shown, of) if not paths])
        self.assertEqual(set(sum(of, [])), set(files))


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
