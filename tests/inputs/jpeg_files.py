"""A baseline JPEG encoder that is exact to a grey level, also for Adobe's inverted CMYK as Photoshop writes it, which
ffmpeg and OpenCV cannot."""
import struct

import numpy as np

STEP = 2  # of the quantisation
ZIGZAG = sorted(((y, x) for y in range(8) for x in range(8)),
                key=lambda p: (sum(p), p[1] if sum(p) % 2 == 0 else p[0]))
# ITU T.81, annex K.3: numbers of codes by length, and their values.
DC = (bytes([0, 1, 5, 1, 1, 1, 1, 1, 1, 0, 0, 0, 0, 0, 0, 0]), bytes(range(12)))
AC = (bytes([0, 2, 1, 3, 3, 2, 4, 3, 5, 5, 4, 4, 0, 0, 1, 125]), bytes.fromhex(
    "01020300041105122131410613516107227114328191a1082342b1c11552d1f02433627282090a161718191a25262728292a3435363738"
    "393a434445464748494a535455565758595a636465666768696a737475767778797a838485868788898a92939495969798999aa2a3a4"
    "a5a6a7a8a9aab2b3b4b5b6b7b8b9bac2c3c4c5c6c7c8c9cad2d3d4d5d6d7d8d9dae1e2e3e4e5e6e7e8e9eaf1f2f3f4f5f6f7f8f9fa"))


def codes(table):
    words, code, at = {}, 0, 0
    for length, count in enumerate(table[0], 1):
        for value in table[1][at:at + count]:
            words[value] = format(code, f"0{length}b")
            code += 1
        at += count
        code <<= 1
    return words


def bits(value):
    """The size of a coefficient and its bits."""
    size = abs(value).bit_length()
    return size, format(value if value > 0 else value + (1 << size) - 1, f"0{size}b") if size else ""


def coefficients(plane):
    k = np.arange(8)
    dct = np.sqrt(np.where(k == 0, 1, 2) / 8.0)[:, None] * np.cos((2 * k + 1) * k[:, None] * np.pi / 16)
    blocks = plane.reshape(plane.shape[0] // 8, 8, plane.shape[1] // 8, 8).swapaxes(1, 2).reshape(-1, 8, 8) - 128.0
    spectrum = np.round(dct @ blocks @ dct.T / STEP).astype(int)
    return np.stack([spectrum[:, y, x] for y, x in ZIGZAG], axis=1)


def components(picture, cmyk):
    if cmyk:
        black = picture.max(axis=-1).astype(float)
        inks = np.round(255.0 * picture / np.maximum(black, 1.0)[..., None])
        return [inks[..., 0], inks[..., 1], inks[..., 2], black]  # inverted
    r, g, b = (picture[..., c].astype(float) for c in range(3))
    y = 0.299 * r + 0.587 * g + 0.114 * b
    return [y, 128 + (b - y) / 1.772, 128 + (r - y) / 1.402]


def encode(picture, cmyk=False):
    planes = [coefficients(plane) for plane in components(picture, cmyk)]
    dc, ac, out, last = codes(DC), codes(AC), [], [0] * len(planes)
    for block in range(len(planes[0])):
        for c in range(len(planes)):
            values = planes[c][block]
            size, text = bits(int(values[0]) - last[c])
            out += [dc[size], text]
            last[c], previous = int(values[0]), 0
            for at in np.flatnonzero(values[1:]) + 1:
                run = int(at) - previous - 1
                out += [ac[0xF0]] * (run // 16)
                size, text = bits(int(values[at]))
                out += [ac[run % 16 << 4 | size], text]
                previous = int(at)
            if previous < 63:
                out.append(ac[0])
    text = "".join(out)
    text += "1" * (-len(text) % 8)
    scan = int(text, 2).to_bytes(len(text) // 8, "big").replace(b"\xff", b"\xff\0")

    def segment(marker, body):
        return b"\xff" + bytes([marker]) + struct.pack(">H", len(body) + 2) + body
    count = len(planes)
    frame = b"".join(bytes([c + 1, 0x11, 0]) for c in range(count))
    tables = b"".join(bytes([c + 1, 0]) for c in range(count))
    return (b"\xff\xd8" + (segment(0xEE, b"Adobe" + struct.pack(">HHHB", 100, 0, 0, 0)) if cmyk else b"") +
            segment(0xDB, bytes([0] + [STEP] * 64)) +
            segment(0xC0, struct.pack(">BHHB", 8, *picture.shape[:2], count) + frame) +
            segment(0xC4, b"\x00" + DC[0] + DC[1] + b"\x10" + AC[0] + AC[1]) +
            segment(0xDA, bytes([count]) + tables + bytes([0, 63, 0])) + scan + b"\xff\xd9")
