"""A room with walls of colour charts, rendered by plain ray casting: pictures, camera and poses are exact.

The camera looks along +z, with x right and y down; the centre of the first pixel is at (0, 0).
"""
import numpy as np

FPS = 25.0
TILE = 0.3  # m
WALLS = (("z", 3.0), ("x", -1.6), ("x", 1.6), ("y", 1.1), ("y", -1.1))  # of a convex room: nothing hides anything
COLORS = np.array([(0, 160, 0), (40, 30, 200), (220, 60, 20), (128, 128, 128), (200, 200, 40), (180, 30, 160),
                   (40, 170, 180), (235, 235, 235), (16, 16, 16), (90, 60, 30), (250, 150, 150), (20, 90, 60)])
DETAILS = np.array([(0, 0, 0), (255, 255, 255), (200, 40, 40), (60, 60, 60), (40, 60, 190), (230, 220, 120)])
FLAT_MARGIN = 6  # pixels from a flat tile's border, which cameras and codecs blur


class Camera:
    """A pinhole, or a fisheye lens with four coefficients as in cv::fisheye."""

    def __init__(self, width, height, focal, fisheye=None):
        self.width, self.height, self.focal, self.fisheye = width, height, focal, fisheye
        self.cx, self.cy = 0.5 * (width - 1), 0.5 * (height - 1)

    def rays(self, x, y):
        mx, my = (x - self.cx) / self.focal, (y - self.cy) / self.focal
        if self.fisheye:
            distorted = np.hypot(mx, my)
            angle = distorted.copy()
            for _ in range(20):
                angle = distorted / (1 + sum(k * angle ** (2 * i + 2) for i, k in enumerate(self.fisheye)))
            scale = np.where(distorted > 1e-9, np.tan(angle) / np.maximum(distorted, 1e-9), 1.0)
            mx, my = mx * scale, my * scale
        return np.stack([mx, my, np.ones_like(mx)], axis=-1)

    def yaml(self):
        text = (f"width: {self.width}\nheight: {self.height}\nfx: {self.focal}\nfy: {self.focal}\n"
                f"cx: {self.cx}\ncy: {self.cy}\nfps: {FPS}\n")
        if self.fisheye:
            text += f"distortion_model: fisheye\ndistortion: {list(self.fisheye)}\n"
        return text


def pose(i, count):
    """Rotation and position of the camera in the room, at an uneven pace."""
    s = i / (count - 1)
    position = np.array([0.9 * (s - 0.5) + 0.05 * np.sin(9 * s), 0.12 * np.sin(7 * s), 0.25 * np.sin(4 * s)])
    yaw, pitch = -0.16 * (s - 0.5), 0.05 * np.sin(5 * s)
    turn = np.array([[np.cos(yaw), 0, np.sin(yaw)], [0, 1, 0], [-np.sin(yaw), 0, np.cos(yaw)]])
    nod = np.array([[1, 0, 0], [0, np.cos(pitch), -np.sin(pitch)], [0, np.sin(pitch), np.cos(pitch)]])
    return turn @ nod, position


def scramble(*numbers):
    value = np.zeros_like(numbers[0], dtype=np.uint64)
    for number in numbers:
        value = (value ^ (number.astype(np.int64) + 1000).astype(np.uint64)) * np.uint64(0x9E3779B97F4A7C15)
        value ^= value >> np.uint64(29)
    return value >> np.uint64(7)


def surface(origin, rays):
    """Colours and tiles (-1: not of one colour) where the rays end."""
    best = np.full(rays.shape[:-1], np.inf)
    u, v, wall = np.zeros_like(best), np.zeros_like(best), np.zeros_like(best, dtype=np.int64)
    for number, (axis, offset) in enumerate(WALLS):
        a = "xyz".index(axis)
        with np.errstate(divide="ignore", invalid="ignore"):
            length = (offset - origin[a]) / rays[..., a]
        nearer = (length > 0) & (length < best)
        at = origin + rays * np.where(nearer, length, 0.0)[..., None]
        others = [b for b in range(3) if b != a]
        best, wall = np.where(nearer, length, best), np.where(nearer, number, wall)
        u, v = np.where(nearer, at[..., others[0]], u), np.where(nearer, at[..., others[1]], v)
    column, row = np.floor(u / TILE), np.floor(v / TILE)
    key = scramble(wall, column, row)
    cell = scramble(wall, np.floor(u / TILE * 4), np.floor(v / TILE * 4))
    flat = key % np.uint64(5) < 3
    colors = np.where(flat[..., None], COLORS[((key >> np.uint64(8)) % np.uint64(len(COLORS))).astype(int)],
                      DETAILS[(cell % np.uint64(len(DETAILS))).astype(int)])
    tiles = np.where(flat, ((wall * 64 + column + 32) * 64 + row + 32).astype(int), -1)
    return colors, tiles


def filtered(array, reach, reduce):
    """Reduces the square neighbourhood of each pixel: np.minimum, np.maximum."""
    for axis in (0, 1):
        padded = np.pad(array, [(reach, reach) if a == axis else (0, 0) for a in range(array.ndim)], "edge")
        parts = [np.take(padded, range(k, k + array.shape[axis]), axis) for k in range(2 * reach + 1)]
        array = reduce.reduce(parts)
    return array


class Room:
    """Pictures of a way through the room. pictures: N x H x W x 3, R G B; flat: the tile of each pixel that lies
    well inside one of a single colour, otherwise -1."""

    def __init__(self, camera, count):
        self.camera, self.count = camera, count
        self.poses = [pose(i, count) for i in range(count)]
        self.pictures, self.flat = [], []
        y, x = np.mgrid[0:camera.height, 0:camera.width].astype(float)
        for rotation, position in self.poses:
            samples = [surface(position, camera.rays(x + dx, y + dy) @ rotation.T)
                       for dx in (-0.25, 0.25) for dy in (-0.25, 0.25)]
            self.pictures.append(np.round(np.mean([s[0] for s in samples], axis=0)).astype(np.uint8))
            tiles = np.stack([s[1] for s in samples])
            tile = np.where((tiles == tiles[0]).all(axis=0), tiles[0], -1)
            same = filtered(tile, FLAT_MARGIN, np.minimum) == filtered(tile, FLAT_MARGIN, np.maximum)
            self.flat.append(np.where(same, tile, -1))

    def error(self, image, i):
        """The largest difference of a tile's median colour in the image from the true one, in grey levels."""
        worst = 0.0
        tiles, counts = np.unique(self.flat[i], return_counts=True)
        for tile, count in zip(tiles, counts):
            if tile >= 0 and count >= 80:
                inside = self.flat[i] == tile
                seen = np.median(image[inside].astype(float), axis=0)
                worst = max(worst, np.abs(seen - self.pictures[i][inside][0]).max())
        return worst

    def nearest(self, image):
        """The number of the picture that is most like the image."""
        small = image[::2, ::2].astype(int)
        return int(np.argmin([np.abs(p[::2, ::2].astype(int) - small).mean() for p in self.pictures]))
