"""Writes the pictures of a room as the files that people bring: images of many kinds and films. All show the same
pictures, only their storage differs."""
import pathlib
import struct
import subprocess
import zlib

import numpy as np

import jpeg_files
from chart_room import FPS


def ffmpeg(*arguments, data=None):
    done = subprocess.run(["ffmpeg", "-nostdin" if data is None else "-y", "-v", "error", "-y",
                           *map(str, arguments)], input=data, capture_output=True)
    if done.returncode:
        raise RuntimeError(f"ffmpeg {' '.join(map(str, arguments))}: {done.stderr.decode()[-500:]}")
    return done.stdout


def raw(size):
    return ["-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{size[1]}x{size[0]}", "-r", FPS, "-i", "-"]


def read_image(path):
    """The pixels as they are stored, without EXIF."""
    probe = subprocess.run(["ffprobe", "-v", "error", "-select_streams", "v:0", "-show_entries", "stream=width,height",
                            "-of", "csv=p=0", str(path)], capture_output=True, text=True, check=True)
    width, height = map(int, probe.stdout.strip().strip(",").split(","))
    pixels = ffmpeg("-noautorotate", "-i", path, "-vf", "scale=flags=accurate_rnd+full_chroma_int", "-frames:v", 1,
                    "-f", "rawvideo", "-pix_fmt", "rgb24", "-")
    return np.frombuffer(pixels, np.uint8).reshape(height, width, 3)


# ---- Images

STORED = {1: lambda p: p, 2: lambda p: p[:, ::-1], 3: lambda p: p[::-1, ::-1], 4: lambda p: p[::-1],
          5: lambda p: p.swapaxes(0, 1), 6: lambda p: np.rot90(p), 7: lambda p: p.swapaxes(0, 1)[::-1, ::-1],
          8: lambda p: np.rot90(p, -1)}  # of a shown picture, by EXIF orientation


def jpeg(picture, orientation):
    encoded = jpeg_files.encode(np.ascontiguousarray(STORED[orientation](picture)))
    entry = struct.pack("<HHIHH", 0x0112, 3, 1, orientation, 0)
    exif = b"Exif\0\0II*\0" + struct.pack("<IH", 8, 1) + entry + struct.pack("<I", 0)
    return encoded[:2] + b"\xff\xe1" + struct.pack(">H", len(exif) + 2) + exif + encoded[2:]


def png(pixels, bits, color, palette=None):
    def chunk(kind, body):
        return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))
    rows = pixels.astype(">u2" if bits == 16 else np.uint8).reshape(pixels.shape[0], -1)
    lines = b"".join(b"\0" + row.tobytes() for row in rows)
    header = struct.pack(">IIBBBBB", pixels.shape[1], pixels.shape[0], bits, color, 0, 0, 0)
    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) +
            (chunk(b"PLTE", palette.astype(np.uint8).tobytes()) if palette is not None else b"") +
            chunk(b"IDAT", zlib.compress(lines, 1)) + chunk(b"IEND", b""))


def with_alpha(picture):
    alpha = np.full(picture.shape[:2], 255)
    alpha[:, : picture.shape[1] // 2] = 128
    return np.dstack([picture, alpha])


def in_palette(room, picture):
    colors = np.unique(np.concatenate([p[f >= 0] for p, f in zip(room.pictures[:1], room.flat[:1])] +
                                      [g.reshape(-1, 3) for g in (palette_steps(),)]), axis=0)[:256]
    distances = ((picture[..., None, :].astype(np.int32) - colors.astype(np.int32)) ** 2).sum(axis=-1)
    return png(distances.argmin(axis=-1), 8, 3, colors)


def palette_steps():
    steps = np.array([0, 60, 128, 200, 255])
    return np.stack(np.meshgrid(steps, steps, steps), axis=-1).astype(np.uint8)


IMAGES = {f"jpeg-{o}": (".jpg", lambda room, p, o=o: jpeg(p, o)) for o in range(1, 9)}
IMAGES |= {
    "png-8": (".png", lambda room, p: png(p, 8, 2)),
    "png-16": (".png", lambda room, p: png(p.astype(int) * 257, 16, 2)),
    "png-12-in-16": (".png", lambda room, p: png(np.round(p * (4095.0 / 255.0)), 16, 2)),
    "png-palette": (".png", in_palette),
    "png-alpha": (".png", lambda room, p: png(with_alpha(p), 8, 6)),
    "cmyk": (".jpg", lambda room, p: jpeg_files.encode(p, cmyk=True)),
    "webp": (".webp", lambda room, p: ffmpeg(*raw(p.shape), "-c:v", "libwebp", "-lossless", 1, "-pix_fmt", "bgra",
                                             "-f", "webp", "-", data=p.tobytes())),
    "tiff": (".tif", lambda room, p: ffmpeg(*raw(p.shape), "-f", "image2pipe", "-c:v", "tiff", "-", data=p.tobytes())),
}


def write_images(kind, room, folder):
    """Returns the folder and the number of the picture of each frame."""
    extension, encode = IMAGES[kind]
    folder.mkdir(parents=True)
    (folder / "camera.yaml").write_text(room.camera.yaml())
    for i, picture in enumerate(room.pictures):
        (folder / f"{i:04}{extension}").write_bytes(encode(room, picture))
    return folder, list(range(room.count))


# ---- Films

H264 = ["-c:v", "libx264", "-preset", "veryfast", "-qp", 4, "-g", 8]


def yuv(matrix="bt601", range_="tv", pixels="yuv420p"):
    return f"scale=out_color_matrix={matrix}:out_range={range_}:flags=accurate_rnd+full_chroma_int,format={pixels}"


def film(room, path, options, pictures=None):
    pictures = room.pictures if pictures is None else pictures
    ffmpeg(*raw(pictures[0].shape), *options, path, data=b"".join(np.ascontiguousarray(p).tobytes() for p in pictures))
    return path, list(range(room.count))


def colored(matrix, tag, range_, pixels="yuv420p"):
    return lambda room, folder: film(room, folder / "film.mp4", [
        "-vf", yuv(matrix, range_, pixels), "-colorspace", tag, "-color_range", range_, *H264])


def rotated(degrees):
    def make(room, folder):
        turned = [np.rot90(p, -degrees // 90) for p in room.pictures]
        film(room, folder / "flat.mp4", ["-vf", yuv(), *H264], turned)
        ffmpeg("-i", folder / "flat.mp4", "-c", "copy", "-metadata:s:v", f"rotate={degrees}",
               folder / "film.mp4")
        return folder / "film.mp4", list(range(room.count))
    return make


def anamorphic(room, folder):
    width = room.camera.width
    return film(room, folder / "film.mp4", ["-vf", f"scale={width // 4 * 3}:ih:flags=bicubic+accurate_rnd,setsar=4/3," +
                                            yuv(), *H264])


def cut(share):
    def make(room, folder):
        film(room, folder / "whole.ts", ["-vf", yuv(), "-bf", 2, *H264, "-muxrate", 8000000])
        data = (folder / "whole.ts").read_bytes()
        (folder / "film.ts").write_bytes(data[int(share * len(data)):])
        return folder / "film.ts", None  # the first picture is told by its content
    return make


def variable(room, folder):
    path, frames = film(room, folder / "film.mp4", ["-vf", yuv() + ",select='not(eq(mod(n,5),2))'", "-vsync", "vfr", *H264])
    return path, [i for i in frames if i % 5 != 2]


def edit_list(room, folder):
    film(room, folder / "whole.mp4", ["-vf", yuv(), *H264])
    ffmpeg("-ss", 4.5 / FPS, "-i", folder / "whole.mp4", "-c", "copy", folder / "film.mp4")
    return folder / "film.mp4", list(range(5, room.count))


def cover(first):
    def make(room, folder):
        film(room, folder / "only.mp4", ["-vf", yuv(), *H264])
        ffmpeg("-f", "lavfi", "-i", "color=red:s=500x500", "-frames:v", 1, folder / "cover.png")
        order = ["-map", 1, "-map", 0] if first else ["-map", 0, "-map", 1]
        ffmpeg("-i", folder / "only.mp4", "-i", folder / "cover.png", *order, "-c", "copy",
               f"-disposition:v:{0 if first else 1}", "attached_pic", folder / "film.mp4")
        return folder / "film.mp4", list(range(room.count))
    return make


def two_streams(room, folder):
    film(room, folder / "only.mp4", ["-vf", yuv(), *H264])
    film(room, folder / "small.mp4", ["-vf", "scale=160:120," + yuv(), *H264])
    ffmpeg("-i", folder / "only.mp4", "-i", folder / "small.mp4", "-map", 1, "-map", 0, "-c", "copy",
           "-disposition:v:0", 0, "-disposition:v:1", 0, folder / "film.mkv")
    return folder / "film.mkv", list(range(room.count))


def audio_only(room, folder):
    ffmpeg("-f", "lavfi", "-i", "sine=d=1", "-c:a", "aac", folder / "film.m4a")
    return folder / "film.m4a", []


FILMS = {
    "h264": lambda room, folder: film(room, folder / "film.mp4", ["-vf", yuv(), *H264]),
    "hevc": lambda room, folder: film(room, folder / "film.mp4", [
        "-vf", yuv(), "-c:v", "libx265", "-preset", "veryfast", "-x265-params", "log-level=none:qp=4"]),
    "vp9": lambda room, folder: film(room, folder / "film.webm", [
        "-vf", yuv(), "-c:v", "libvpx-vp9", "-crf", 6, "-b:v", 0, "-deadline", "realtime", "-cpu-used", 8]),
    "ts-cut-0.13": cut(0.13), "ts-cut-0.37": cut(0.37), "ts-cut-0.52": cut(0.52),
    "rotated-90": rotated(90), "rotated-180": rotated(180), "rotated-270": rotated(270),
    "anamorphic": anamorphic,
    "bt601-limited": colored("bt601", "smpte170m", "tv"), "bt601-full": colored("bt601", "smpte170m", "pc"),
    "bt709-limited": colored("bt709", "bt709", "tv"), "bt709-full": colored("bt709", "bt709", "pc"),
    "bt709-all-colours": colored("bt709", "bt709", "tv", "yuv444p"),
    "variable-rate": variable, "edit-list": edit_list, "cover-first": cover(True), "cover-last": cover(False),
    "two-streams": two_streams, "audio-only": audio_only,
}


def write_film(kind, room, folder):
    folder.mkdir(parents=True)
    (folder / "camera.yaml").write_text(room.camera.yaml())
    return FILMS[kind](room, folder)
