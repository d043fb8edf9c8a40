"""Reads what `sqslam export` writes from the specifications of the formats alone: COLMAP's text model (its manual, Output
Format) and nerfstudio's transforms.json (its documentation, Data conventions), and the clouds and meshes of a result."""
import json
import struct

import numpy as np


def quaternion(w, x, y, z):
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                     [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                     [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]])


class Lens:
    """Focal lengths, centre and distortion; the centre of the first pixel is at (0.5, 0.5) in both formats."""

    def __init__(self, width, height, fx, fy, cx, cy, model, coefficients):
        self.width, self.height, self.model = width, height, model
        self.f, self.c, self.k = np.array([fx, fy]), np.array([cx, cy]), coefficients

    def project(self, points):
        """Pixels of points in the camera's frame, x right, y down, z ahead."""
        m = points[:, :2] / points[:, 2:]
        r = np.linalg.norm(m, axis=1, keepdims=True)
        k1, k2, p1, p2, k3, k4, k5, k6 = self.k
        if self.model.endswith("FISHEYE"):
            t = np.arctan(r)
            m = m * t * (1 + k1 * t**2 + k2 * t**4 + k3 * t**6 + k4 * t**8) / np.maximum(r, 1e-12)
        else:
            x, y = m[:, :1], m[:, 1:]
            radial = (1 + k1 * r**2 + k2 * r**4 + k3 * r**6) / (1 + k4 * r**2 + k5 * r**4 + k6 * r**6)
            tangential = np.hstack([2 * p1 * x * y + p2 * (r**2 + 2 * x * x), p1 * (r**2 + 2 * y * y) + 2 * p2 * x * y])
            m = m * radial + tangential
        return m * self.f + self.c


class View:
    """An image: its file, lens, and the pose of the map in its camera."""

    def __init__(self, file, lens, rotation, translation):
        self.file, self.lens, self.rotation, self.translation = file, lens, rotation, translation
        self.image = None  # its pixels, once they are read

    @property
    def center(self):
        return -self.rotation.T @ self.translation

    def project(self, points):
        """Pixels, and whether the points are ahead and in the image."""
        inside = points @ self.rotation.T + self.translation
        with np.errstate(divide="ignore", invalid="ignore"):
            pixels = self.lens.project(inside)
        limits = np.array([self.lens.width, self.lens.height])
        return pixels, (inside[:, 2] > 0) & (pixels >= 0).all(axis=1) & (pixels < limits).all(axis=1)


COLMAP_MODELS = {"PINHOLE": "", "OPENCV": "k1 k2 p1 p2", "FULL_OPENCV": "k1 k2 p1 p2 k3 k4 k5 k6",
                 "OPENCV_FISHEYE": "k1 k2 k3 k4"}
NAMES = "k1 k2 p1 p2 k3 k4 k5 k6".split()


def rows(path):
    return [line.split() for line in path.read_text().splitlines() if not line.startswith("#")]


def read_colmap(folder):
    """Views, points, colours, tracks [(view, x, y)] of each point, and the mean over points of their mean errors."""
    (row,) = rows(folder / "sparse/0/cameras.txt")
    numbers = [float(v) for v in row[4:]]
    named = dict(zip(COLMAP_MODELS[row[1]].split(), numbers[4:]))
    lens = Lens(int(row[2]), int(row[3]), *numbers[:4], row[1], [named.get(name, 0.0) for name in NAMES])
    views, keypoints = {}, {}
    lines = rows(folder / "sparse/0/images.txt")
    for head, points in zip(lines[::2], lines[1::2]):
        number = int(head[0])
        views[number] = View(folder / "images" / head[9], lens, quaternion(*map(float, head[1:5])),
                             np.array(head[5:8], float))
        keypoints[number] = np.array(points, float).reshape(-1, 3)
    points, colors, tracks, errors = [], [], [], []
    for row in rows(folder / "sparse/0/points3D.txt"):
        points.append([float(v) for v in row[1:4]])
        colors.append([int(v) for v in row[4:7]])
        tracks.append([])
        errors.append([])
        for image, index in zip(map(int, row[8::2]), map(int, row[9::2])):
            x, y, point = keypoints[image][index]
            assert int(point) == int(row[0]), f"image {image}, keypoint {index}: point {point}, not {row[0]}"
            tracks[-1].append((views[image], x, y))
            (pixel,), _ = views[image].project(np.array([points[-1]]))
            errors[-1].append(np.hypot(*(pixel - (x, y))))
    mean = float(np.mean([np.mean(of_point) for of_point in errors]))
    return list(views.values()), np.array(points), np.array(colors), tracks, mean


def read_nerfstudio(folder):
    """Views, points and colours. Cameras look along -z with y up."""
    root = json.loads((folder / "transforms.json").read_text())
    views = []
    for frame in root["frames"]:
        get = {**root, **frame}.get
        lens = Lens(get("w"), get("h"), get("fl_x"), get("fl_y"), get("cx"), get("cy"), get("camera_model"),
                    [get(name, 0.0) for name in NAMES])
        pose = np.array(frame["transform_matrix"]) @ np.diag([1, -1, -1, 1])
        assert np.allclose(pose[:3, :3] @ pose[:3, :3].T, np.eye(3), atol=1e-5)
        rotation = pose[:3, :3].T
        views.append(View(folder / frame["file_path"], lens, rotation, -rotation @ pose[:3, 3]))
    cloud = read_ply(folder / root["ply_file_path"])
    return views, cloud


def read_ply(path):
    """Points and colours of a binary PLY of one element."""
    data = path.read_bytes()
    end = data.index(b"end_header\n") + len(b"end_header\n")
    header = data[:end].decode().splitlines()
    kinds = {"float": "<f4", "double": "<f8", "uchar": "u1", "int": "<i4", "short": "<i2", "ushort": "<u2", "uint": "<u4"}
    fields = [(line.split()[2], kinds[line.split()[1]]) for line in header if line.startswith("property")]
    count = next(int(line.split()[2]) for line in header if line.startswith("element vertex"))
    table = np.frombuffer(data[end:], np.dtype(fields), count)
    return (np.stack([table[name].astype(float) for name in "xyz"], axis=1),
            np.stack([table[name].astype(int) for name in ("red", "green", "blue")], axis=1))


def read_glb(path):
    """Vertices in the map's frame (z up) and their colours in sRGB."""
    data = path.read_bytes()
    (length,) = struct.unpack("<I", data[12:16])
    root, binary = json.loads(data[20:20 + length]), data[28 + length:]

    def accessor(number):
        entry = root["accessors"][number]
        view = root["bufferViews"][entry["bufferView"]]
        kind = {5126: "<f4", 5123: "<u2", 5121: "u1"}[entry["componentType"]]
        size = {"VEC3": 3, "VEC4": 4}[entry["type"]]
        start = view.get("byteOffset", 0) + entry.get("byteOffset", 0)
        step = view.get("byteStride", size * np.dtype(kind).itemsize)
        return np.ndarray((entry["count"], size), kind, binary, start, (step, np.dtype(kind).itemsize)).astype(float)
    vertices, colors = [], []

    def visit(number, parent):
        node = root["nodes"][number]
        own = np.eye(4)
        x, y, z, w = node.get("rotation", (0, 0, 0, 1))
        own[:3, :3] = quaternion(w, x, y, z) * node.get("scale", (1, 1, 1))
        own[:3, 3] = node.get("translation", (0, 0, 0))
        pose = parent @ (np.array(node["matrix"]).reshape(4, 4).T if "matrix" in node else own)
        for part in root["meshes"][node["mesh"]]["primitives"] if "mesh" in node else []:
            attributes = part["attributes"]
            vertices.append(accessor(attributes["POSITION"]) @ pose[:3, :3].T + pose[:3, 3])
            linear = accessor(attributes["COLOR_0"])[:, :3] / 65535.0
            colors.append(255 * np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055))
        for child in node.get("children", []):
            visit(child, pose)
    for number in root["scenes"][root["scene"]]["nodes"]:
        visit(number, np.eye(4))
    y_up = np.concatenate(vertices)
    return np.stack([y_up[:, 0], -y_up[:, 2], y_up[:, 1]], axis=1), np.concatenate(colors)
