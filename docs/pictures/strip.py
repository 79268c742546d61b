#!/usr/bin/python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""The strip of pictures of README.md, from the three-quarter views of a run: strip.py out/demo docs/pictures/strip.png"""
import struct
import sys
import zlib

import numpy as np

VIEWS = ["skull_dowels", "face_over_skull", "face", "truth"]
TOP, BOTTOM, LEFT, RIGHT = 24, 664, 600, 1160  # of the middle view on a sheet of 1760 x 688 pixels


def read_png(path):
    """The pixels of an 8-bit RGB PNG, height x width x 3."""
    with open(path, "rb") as file:
        data = file.read()
    at, packed = 8, b""
    while at < len(data):
        length, kind = struct.unpack(">I4s", data[at:at + 8])
        body = data[at + 8:at + 8 + length]
        if kind == b"IHDR":
            width, height = struct.unpack(">II", body[:8])
        packed += body if kind == b"IDAT" else b""
        at += 12 + length
    rows = np.frombuffer(zlib.decompress(packed), np.uint8).reshape(height, 1 + 3 * width)
    image = np.zeros((height, 3 * width), np.int64)
    above = np.zeros(3 * width, np.int64)
    for y in range(height):
        mode, row = rows[y, 0], rows[y, 1:].astype(np.int64)
        if mode == 2:
            row = row + above
        elif mode != 0:
            for x in range(3 * width):
                left, up, corner = (row[x - 3], above[x], above[x - 3]) if x >= 3 else (0, above[x], 0)
                paeth = min((abs(up - corner), 0, left), (abs(left - corner), 1, up), (abs(left + up - 2 * corner), 2, corner))[2]
                row[x] = (row[x] + {1: left, 3: (left + up) // 2, 4: paeth}[mode]) & 255
        above = image[y] = row & 255
    return image.reshape(height, width, 3)


def write_png(path, image):
    height, width, _ = image.shape
    chunk = lambda kind, body: struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))
    raw = np.hstack([np.zeros((height, 1), np.uint8), image.reshape(height, -1)]).tobytes()
    with open(path, "wb") as file:
        file.write(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)) +
                   chunk(b"IDAT", zlib.compress(raw, 9)) + chunk(b"IEND", b""))


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit("usage: strip.py RUN OUT.png")
    views = [read_png(f"{sys.argv[1]}/pictures/{name}.png")[TOP:BOTTOM, LEFT:RIGHT] for name in VIEWS]
    strip = np.hstack(views)
    small = strip.reshape(strip.shape[0] // 2, 2, strip.shape[1] // 2, 2, 3).mean((1, 3))
    write_png(sys.argv[2], small.round().astype(np.uint8))
