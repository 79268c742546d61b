# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads the meshes that the program writes, and draws them for docs/thesis.md. The program's own pictures show a whole run; these show one mesh,
its triangles, or a part of it."""
import struct
import sys
import zlib
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "pictures"))
from strip import read_png  # noqa: E402

SKIN, BONE, RED, BLUE, INK, PAPER = (226, 178, 150), (222, 212, 192), (192, 57, 43), (47, 127, 193), (40, 44, 50), (246, 248, 250)
PLY_TYPES = {"float": "<f4", "double": "<f8", "uchar": "u1", "int": "<i4", "uint": "<u4"}


def read_ply(path):
    """The vertices as a structured array and the triangles, n x 3, of a binary PLY that the program wrote."""
    data = Path(path).read_bytes()
    end = data.index(b"end_header\n") + len(b"end_header\n")
    elements = []
    for words in map(str.split, data[:end].decode().splitlines()):
        if words[0] == "element":
            elements.append((words[1], int(words[2]), []))
        elif words[0] == "property" and words[1] != "list":
            elements[-1][2].append((words[2], PLY_TYPES[words[1]]))
    (_, count, fields), (_, faces, more) = elements[:2]
    vertices = np.frombuffer(data, np.dtype(fields), count, end)
    face = np.dtype([("size", "u1"), ("corners", "<i4", 3), *more])
    triangles = np.frombuffer(data, face, faces, end + vertices.nbytes)["corners"]
    return vertices, triangles.astype(np.int64)


def points_of(vertices):
    return np.stack([vertices["x"], vertices["y"], vertices["z"]], -1).astype(float)


def read_mesh(path):
    vertices, triangles = read_ply(path)
    return points_of(vertices), triangles


def vertex_normals(points, triangles):
    a, b, c = (points[triangles[:, k]] for k in range(3))
    area = np.cross(b - a, c - a)
    normals = np.zeros_like(points)
    for k in range(3):
        np.add.at(normals, triangles[:, k], area)
    return normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-30)


def genus(triangles):
    """The number of handles of a closed mesh in one piece."""
    edges = np.sort(np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]), 1)
    count = len(np.unique(edges, axis=0))
    return 1 - (len(np.unique(triangles)) - count + len(triangles)) / 2


def distance_mm(point, triangles):
    """The distance of a point from the nearest of many triangles (n x 3 corners x 3): the plane, if the foot lies inside, else the edges."""
    a, b, c = triangles.swapaxes(0, 1)
    normal = np.cross(b - a, c - a)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    height = ((point - a) * normal).sum(1)
    foot = point - height[:, None] * normal
    inside = np.all([(np.cross(q - p, foot - p) * normal).sum(1) >= 0 for p, q in ((a, b), (b, c), (c, a))], axis=0)
    best = np.abs(height[inside]).min(initial=np.inf)
    for p, q in ((a, b), (b, c), (c, a)):
        t = np.clip(((point - p) * (q - p)).sum(1) / ((q - p)**2).sum(1), 0, 1)
        best = min(best, np.linalg.norm(p + t[:, None] * (q - p) - point, axis=1).min())
    return best


# ---------------------------------------------------------------------------------------------------------------------
# A picture of meshes
# ---------------------------------------------------------------------------------------------------------------------

class Picture:
    """An orthographic view, drawn at twice its size. Triangles are drawn as samples half a pixel apart, so any size of triangle is drawn in the
    same way and numpy does all of the work."""
    FINE = 2

    def __init__(self, width, height, centre_mm, pixels_per_mm, azimuth_deg=0.0, elevation_deg=0.0):
        self.width, self.height = width * self.FINE, height * self.FINE
        self.centre, self.scale = np.asarray(centre_mm, float), pixels_per_mm * self.FINE
        a, e = np.radians([azimuth_deg, elevation_deg])
        self.axes = np.array([[np.cos(a), np.sin(a), 0], [-np.sin(a) * np.sin(e), np.cos(a) * np.sin(e), np.cos(e)],
                              [np.sin(a) * np.cos(e), -np.cos(a) * np.cos(e), np.sin(e)]])
        self.colours = np.tile(np.array(PAPER, np.float32), (self.width * self.height, 1))
        self.nearest = np.full(self.width * self.height, -np.inf)

    def project(self, points):
        """Columns, rows and heights towards the viewer, in fine pixels."""
        seen = (np.asarray(points, float) - self.centre) @ self.axes.T * self.scale
        return np.stack([self.width / 2 + seen[:, 0], self.height / 2 - seen[:, 1], seen[:, 2]], -1)

    def put(self, places, colours):
        """Keeps the samples that are nearest to the viewer."""
        column, row = places[:, 0].astype(int), places[:, 1].astype(int)
        inside = (places[:, 0] >= 0) & (places[:, 1] >= 0) & (column < self.width) & (row < self.height)
        pixel, depth = (row * self.width + column)[inside], places[inside, 2]
        order = np.argsort(depth, kind="stable")
        pixel, depth, colours = pixel[order], depth[order], colours[inside][order]
        seen = depth > self.nearest[pixel]
        self.colours[pixel[seen]] = colours[seen]
        self.nearest[pixel[seen]] = depth[seen]

    def shades(self, normals, colours):
        """Light from the viewer's upper left. A back is grey and darker."""
        seen = normals @ self.axes.T
        key = np.clip(seen @ (np.array([-0.4, 0.5, 0.77])), 0, 1)[:, None]
        front = np.asarray(colours, float) * (0.34 + 0.68 * key)
        back = np.array([118, 112, 108]) * (0.5 + 0.5 * np.abs(seen[:, 2:3]))
        return np.clip(np.where(seen[:, 2:3] >= 0, front, back), 0, 255)

    def mesh(self, points, triangles, colours=SKIN, flat=False):
        """colours: one for all vertices, or one per vertex. flat: each triangle has the light of its own plane."""
        if flat:
            points, colours = points[triangles].reshape(-1, 3), np.broadcast_to(colours, points.shape)[triangles].reshape(-1, 3)
            triangles = np.arange(len(points)).reshape(-1, 3)
        places = self.project(points)
        shades = self.shades(vertex_normals(points, triangles), np.broadcast_to(colours, points.shape))
        corners = places[triangles]
        reach = np.max([np.linalg.norm(corners[:, k] - corners[:, k - 1], axis=1) for k in range(3)], axis=0)
        steps = np.maximum(np.ceil(1.5 * reach).astype(int), 1)
        for n in np.unique(steps):
            chosen = triangles[steps == n]
            i, j = np.meshgrid(np.arange(n + 1), np.arange(n + 1), indexing="ij")
            inside = i + j <= n
            weights = np.stack([i[inside], j[inside], (n - i - j)[inside]], -1) / n
            for part in np.array_split(chosen, max(1, len(chosen) * len(weights) // 2_000_000)):
                self.put(np.einsum("wk,tkd->twd", weights, places[part]).reshape(-1, 3),
                         np.einsum("wk,tkd->twd", weights, shades[part]).reshape(-1, 3))

    def lines(self, starts, ends, colour=INK, lift_mm=0.25, width=1):
        """Lines between points, lifted towards the viewer so that they lie on the surface."""
        a, b = self.project(starts), self.project(ends)
        steps = np.maximum(np.ceil(np.linalg.norm(b - a, axis=1) * 1.5).astype(int), 1)
        for n in np.unique(steps):
            t = np.linspace(0, 1, n + 1)[None, :, None]
            places = (a[steps == n, None] * (1 - t) + b[steps == n, None] * t).reshape(-1, 3) + (0, 0, lift_mm * self.scale)
            for dx in range(width):
                for dy in range(width):
                    self.put(places + (dx - width / 2, dy - width / 2, 0), np.broadcast_to(np.array(colour, float), places.shape))

    def wires(self, points, triangles, colour=INK):
        """The edges of triangles that face the viewer."""
        a, b, c = (points[triangles[:, k]] for k in range(3))
        facing = triangles[np.cross(b - a, c - a) @ self.axes[2] > 0]
        edges = np.unique(np.sort(np.concatenate([facing[:, [0, 1]], facing[:, [1, 2]], facing[:, [2, 0]]]), 1), axis=0)
        self.lines(points[edges[:, 0]], points[edges[:, 1]], colour)

    def rods(self, bases, tips, radius_mm, colour=RED):
        """Round rods with a ball at the tip, as cylinders of 12 sides."""
        for base, tip in zip(np.asarray(bases, float), np.asarray(tips, float)):
            along = (tip - base) / max(np.linalg.norm(tip - base), 1e-9)
            side = np.cross(along, [0.3, 0.5, 0.8])
            side /= np.linalg.norm(side)
            turn = np.linspace(0, 2 * np.pi, 12, endpoint=False)[:, None]
            ring = radius_mm * (np.cos(turn) * side + np.sin(turn) * np.cross(along, side))
            k = np.arange(12)
            triangles = np.concatenate([np.stack([k, (k + 1) % 12, k + 12], 1), np.stack([(k + 1) % 12, (k + 1) % 12 + 12, k + 12], 1)])
            self.mesh(np.vstack([base + ring, tip + ring]), triangles, colour)
            self.ball(tip, 1.5 * radius_mm, colour)

    def ball(self, centre, radius_mm, colour=RED):
        u, v = np.meshgrid(np.linspace(0, 2 * np.pi, 17), np.linspace(0, np.pi, 9))
        points = np.stack([np.cos(u) * np.sin(v), np.sin(u) * np.sin(v), np.cos(v)], -1).reshape(-1, 3) * radius_mm + centre
        at = (np.arange(8)[:, None] * 17 + np.arange(16)).ravel()
        self.mesh(points, np.concatenate([np.stack([at, at + 17, at + 1], 1), np.stack([at + 1, at + 17, at + 18], 1)]), colour)

    def pixels(self):
        fine = self.colours.reshape(self.height // self.FINE, self.FINE, self.width // self.FINE, self.FINE, 3)
        return fine.mean((1, 3)).round().astype(np.uint8)


def in_frame(points, width, height, margin=1.06):
    """Centre and scale with which a view from any side around the z axis holds the points."""
    low, high = points.min(0), points.max(0)
    reach = np.linalg.norm((high - low)[:2])
    return (low + high) / 2, min(width / reach, height / (high[2] - low[2])) / margin


# ---------------------------------------------------------------------------------------------------------------------
# Sheets of pictures
# ---------------------------------------------------------------------------------------------------------------------

def beside(*pictures, gap=6):
    height = max(picture.shape[0] for picture in pictures)
    parts = []
    for picture in pictures:
        padded = np.full((height, picture.shape[1], 3), 255, np.uint8)
        padded[:picture.shape[0]] = picture
        parts += [padded, np.full((height, gap, 3), 255, np.uint8)]
    return np.hstack(parts[:-1])


def below(*sheets, gap=6):
    return beside(*(sheet.swapaxes(0, 1) for sheet in sheets), gap=gap).swapaxes(0, 1)


def halved(picture):
    height, width = picture.shape[0] // 2 * 2, picture.shape[1] // 2 * 2
    return picture[:height, :width].reshape(height // 2, 2, width // 2, 2, 3).astype(float).mean((1, 3)).round().astype(np.uint8)


def on_paper(sheet):
    """A sheet of the program with one colour behind all views. A view's background has one colour per row, that of the row's first pixel."""
    side = (sheet.shape[1] - 2 * 24 - 2 * 16) // 3
    for left in (24, 24 + side + 16, 24 + 2 * (side + 16)):
        view = sheet[24:-24, left:left + side]
        view[(view == view[:, :1]).all(2)] = PAPER
    return sheet


def view_of_run(path, view):
    """View 0 (front), 1 (three quarters) or 2 (side) of a run's picture, at half its size. The sheet has three views with a margin of 24 pixels,
    16 apart (problems/report/pictures/pictures.h)."""
    sheet = on_paper(read_png(path).astype(np.uint8))
    side = (sheet.shape[1] - 2 * 24 - 2 * 16) // 3
    left = 24 + view * (side + 16)
    return halved(sheet[24:-24, left:left + side])


def trimmed(picture, rows):
    """The rows (first, last) of a picture as shares of its height."""
    return picture[int(rows[0] * len(picture)):int(rows[1] * len(picture))]


def few_colours(picture, most=256):
    """The picture as indices and a palette of at most 256 colours. More colours are gathered around the quantiles of their brightness (k-means),
    which keeps ramps of skin and bone smooth."""
    colours, index, counts = np.unique(picture.reshape(-1, 3), axis=0, return_inverse=True, return_counts=True)
    if len(colours) <= most:
        return index.reshape(picture.shape[:2]).astype(np.uint8), colours
    places = colours.astype(float)
    by_light = np.argsort(places.sum(1), kind="stable")
    palette = places[by_light[np.linspace(0, len(colours) - 1, most).astype(int)]]
    weight = np.sqrt(counts)
    for _ in range(8):
        nearest = np.argmin((palette**2).sum(1) - 2 * places @ palette.T, axis=1)
        total = np.bincount(nearest, weight, most)
        for k in range(3):
            sums = np.bincount(nearest, weight * places[:, k], most)
            palette[:, k] = np.where(total > 0, sums / np.maximum(total, 1e-9), palette[:, k])
    return nearest[index].reshape(picture.shape[:2]).astype(np.uint8), palette.round().astype(np.uint8)


def write_png(path, picture):
    """A PNG with a palette: a third of the bytes of one in full colour, because the pictures have few hues."""
    index, palette = few_colours(picture)
    height, width = index.shape
    chunk = lambda kind, body: struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))
    raw = np.hstack([np.zeros((height, 1), np.uint8), index]).tobytes()
    Path(path).write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 3, 0, 0, 0)) +
                           chunk(b"PLTE", palette.tobytes()) + chunk(b"IDAT", zlib.compress(raw, 9)) + chunk(b"IEND", b""))
