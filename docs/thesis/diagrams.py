# SPDX-License-Identifier: GPL-3.0-or-later
"""The line diagrams of docs/thesis.md as SVG. Everything that they show is computed here; nothing is copied from the thesis."""
import itertools

import numpy as np

INK, GREY, BLUE, RED, GREEN = "#1d2126", "#9aa3ad", "#2f7fc1", "#c0392b", "#4f9d69"


class Svg:
    """Shapes in pixels, with y downwards, on white paper, so that a dark page shows them too."""

    def __init__(self, width, height):
        self.size = width, height
        self.parts = []

    def add(self, tag, content="", **attributes):
        words = " ".join(f'{name.replace("_", "-")}="{value:.5g}"' if isinstance(value, (float, np.floating)) else
                         f'{name.replace("_", "-")}="{value}"' for name, value in attributes.items())
        self.parts.append(f"<{tag} {words}>{content}</{tag}>" if content else f"<{tag} {words}/>")

    def line(self, a, b, colour=INK, width=1.2, dash="none"):
        self.add("line", x1=a[0], y1=a[1], x2=b[0], y2=b[1], stroke=colour, stroke_width=width, stroke_dasharray=dash)

    def polygon(self, points, fill="none", colour=INK, width=1.0, opacity=1.0):
        places = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
        self.add("polygon", points=places, fill=fill, stroke=colour, stroke_width=width, fill_opacity=opacity, stroke_linejoin="round")

    def path(self, points, colour=INK, width=1.0, dash="none"):
        places = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
        self.add("polyline", points=places, fill="none", stroke=colour, stroke_width=width, stroke_dasharray=dash)

    def circle(self, at, radius, fill=INK, colour=INK, width=1.0):
        self.add("circle", cx=at[0], cy=at[1], r=float(radius), fill=fill, stroke=colour, stroke_width=width)

    def cross(self, at, size, colour=INK, width=1.4):
        for turn in (1, -1):
            self.line((at[0] - size, at[1] - turn * size), (at[0] + size, at[1] + turn * size), colour, width)

    def text(self, at, words, size=13, anchor="middle", colour=INK):
        self.add("text", words, x=at[0], y=at[1], font_size=size, text_anchor=anchor, fill=colour, font_family="DejaVu Sans, sans-serif")

    def __str__(self):
        width, height = self.size
        return (f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" viewBox="0 0 {width} {height}">\n'
                f'<rect width="{width}" height="{height}" fill="#ffffff"/>\n' + "\n".join(self.parts) + "\n</svg>\n")


def seen_from(azimuth_deg, elevation_deg, scale, centre):
    """An orthographic view: a function from points in space to pixels."""
    a, e = np.radians([azimuth_deg, elevation_deg])
    right = np.array([np.cos(a), np.sin(a), 0])
    up = np.array([-np.sin(a) * np.sin(e), np.cos(a) * np.sin(e), np.cos(e)])
    return lambda p: np.stack([centre[0] + scale * (np.asarray(p, float) @ right), centre[1] - scale * (np.asarray(p, float) @ up)], -1)


# ---------------------------------------------------------------------------------------------------------------------
# 2.2: a cutting plane
# ---------------------------------------------------------------------------------------------------------------------

def cutting_plane_normal(base_i, direction_i, base_j, direction_j):
    """The normal of the plane that holds both bases and is parallel to the sum of the directions (definition 2.4)."""
    normal = np.cross(np.add(direction_i, direction_j), np.subtract(base_j, base_i))
    return normal / np.linalg.norm(normal)


def cutting_plane():
    """Two dowels, the cutting plane between the two areas that share them, and the third dowel of each area."""
    bone = lambda x, y: np.array([x, y, -(x * x + 0.6 * y * y) / 9])
    outward = lambda x, y: np.array([2 * x / 9, 1.2 * y / 9, 1]) / np.linalg.norm([2 * x / 9, 1.2 * y / 9, 1])
    places = {"i": (-1.9, 0.5), "j": (1.9, -0.5), "a": (0.3, 2.4), "b": (-0.4, -2.4)}
    base = {name: bone(*at) for name, at in places.items()}
    direction = {name: outward(*at) for name, at in places.items()}
    view = seen_from(24, 24, 74, (330, 225))
    svg = Svg(660, 400)
    for own, fill in (("a", BLUE), ("b", GREEN)):
        svg.polygon(view([base["i"], base["j"], base[own]]), fill, GREY, 1.0, 0.22)
    along = direction["i"] + direction["j"]
    along /= np.linalg.norm(along)
    step = 0.25 * (base["j"] - base["i"])
    sides = [base["i"] - step, base["j"] + step]
    svg.polygon(view([sides[0] - 0.5 * along, sides[1] - 0.5 * along, sides[1] + 1.9 * along, sides[0] + 1.9 * along]), RED, RED, 1.2, 0.16)
    svg.line(*view([base["i"], base["j"]]), RED, 1.4, "5 3")
    for name in places:
        tip = base[name] + 1.3 * direction[name]
        svg.line(*view([base[name], tip]), INK if name in "ij" else GREY, 4.0 if name in "ij" else 3.0)
        svg.circle(view(base[name]), 4.5, "#ffffff")
    for name in "ij":
        svg.text(view(base[name]) + (-16, 14), f"p{name}")
        svg.text(view(base[name] + 1.3 * direction[name]) + (0, -8), f"n{name}")
    middle = 0.5 * (base["i"] + base["j"])
    svg.line(*view([middle, middle + 1.5 * along]), RED, 1.6, "2 3")
    svg.text(view(middle + 1.5 * along) + (26, -4), "ni + nj", colour=RED)
    svg.text((330, 388), "The plane holds both bases and is parallel to the sum of the two directions.", 12, colour=INK)
    return str(svg)


# ---------------------------------------------------------------------------------------------------------------------
# 3.3: the cases of marching cubes
# ---------------------------------------------------------------------------------------------------------------------

CORNERS = np.array([[c & 1, c >> 1 & 1, c >> 2 & 1] for c in range(8)])
EDGES = [(a, b) for a in range(8) for b in range(a + 1, 8) if bin(a ^ b).count("1") == 1]


def cube_rotations():
    """The 24 proper rotations of a cube, each as the corner to which each corner goes."""
    turns = []
    for order in itertools.permutations(range(3)):
        for signs in itertools.product((1, -1), repeat=3):
            matrix = np.zeros((3, 3), int)
            matrix[range(3), order] = signs
            if round(np.linalg.det(matrix)) == 1:
                moved = ((2 * CORNERS - 1) @ matrix.T + 1) // 2
                turns.append(moved @ [1, 2, 4])
    return turns


def cube_classes(with_inversion=True):
    """The classes of the 256 patterns of inside corners, as sets of patterns. A pattern has bit c if corner c is inside."""
    turns, left, classes = cube_rotations(), set(range(256)), []
    while left:
        first = min(left)
        members = {sum(1 << int(turn[c]) for c in range(8) if pattern >> c & 1)
                   for turn in turns for pattern in ([first, 255 - first] if with_inversion else [first])}
        classes.append(members)
        left -= members
    # With few inside corners first, as in the thesis.
    return sorted(classes, key=lambda members: (min(bin(p).count("1") for p in members), min(members)))


def face_corners():
    """The corners of each face of the cube, in order around it."""
    faces = []
    for axis in range(3):
        b, c = (axis + 1) % 3, (axis + 2) % 3
        for side in (0, 1):
            faces.append([(side << axis) + (x << b) + (y << c) for x, y in ((0, 0), (1, 0), (1, 1), (0, 1))])
    return faces


def joined_edges(pattern):
    """For each crossed edge of the cube, the two that the outline joins it to. Inside corners that lie diagonally on a face are separated, as
    the program does (surfaces/marching/marching_cubes.h), so neighbouring cubes agree and no hole opens."""
    inside = lambda corner: pattern >> corner & 1
    joined = {}
    for face in face_corners():
        for k in range(4):
            before, corner = face[k - 1], face[k]
            # From an edge that enters the inside, around the inside corners, to the next edge that leaves it.
            if inside(corner) and not inside(before):
                n = k
                while inside(face[(n + 1) % 4]):
                    n += 1
                ends = [tuple(sorted((before, corner))), tuple(sorted((face[n % 4], face[(n + 1) % 4])))]
                for a, b in (ends, ends[::-1]):
                    joined.setdefault(a, []).append(b)
    return joined


def case_loops(pattern):
    """The outlines of the surface in a cube, as lists of the middles of edges."""
    joined, loops = joined_edges(pattern), []
    while joined:
        loop = [next(iter(joined))]
        while True:
            onward = [edge for edge in joined.get(loop[-1], []) if edge not in loop]
            if not onward:
                break
            loop.append(onward[0])
        for edge in loop:
            del joined[edge]
        loops.append([CORNERS[list(edge)].mean(0) for edge in loop])
    return loops


def cube_cases():
    """A cube for each class, with its number and the number of patterns that it stands for."""
    classes = cube_classes()
    svg = Svg(800, 524)
    for number, members in enumerate(classes):
        pattern = min(members, key=lambda p: (bin(p).count("1"), p))
        centre = (80 + 160 * (number % 5), 82 + 164 * (number // 5))
        view = seen_from(38, 24, 76, centre)
        places = view(CORNERS - 0.5)
        for a, b in EDGES:
            hidden = 2 in (a, b)  # the corner that lies behind
            svg.line(places[a], places[b], GREY if hidden else INK, 1.0, "3 3" if hidden else "none")
        for loop in case_loops(pattern):
            svg.polygon(view(np.array(loop) - 0.5), BLUE, BLUE, 1.0, 0.35)
        for corner in range(8):
            svg.circle(places[corner], 5.5, INK if pattern >> corner & 1 else "#ffffff")
        svg.text((centre[0], centre[1] + 78), f"{number}: stands for {len(members)}", 12)
    svg.text((400, 512), f"{len(classes)} cases, {sum(map(len, classes))} patterns", 13)
    return str(svg)


# ---------------------------------------------------------------------------------------------------------------------
# 3.4: the cache of emitter values
# ---------------------------------------------------------------------------------------------------------------------

def cache_depth(k, cells):
    """The slot of corner layer k for a march of `cells` layers, a power of 2, by the thesis's formula. The formula has no value for k = 0;
    the root of the octree has a corner there, so its depth is 0."""
    return 0 if k == 0 else (cells.bit_length() - 1) - ((k & -k).bit_length() - 1)


def octree_layers(level, cells):
    """For each depth of the octree, the two corner layers that bound the nodes around a level of the march (0 is the first)."""
    depths = cells.bit_length() - 1
    spans = [cells >> depth for depth in range(depths + 1)]
    return [(level // span * span, level // span * span + span) for span in spans]


def octree_nodes(cells):
    """How many nodes of each depth meet one level of the march, if every node is divided."""
    return [4**depth for depth in range(cells.bit_length())]


def cached_corners(cells):
    """How many corners the slots hold: one layer per depth, and one more for layer 0."""
    return (cells.bit_length() + 1) * (cells + 1)**2


def emitter_cache(cells=8, level=2):
    """Left: the corner layers of the march and their slots. Right: the nodes around one level, seen from the side."""
    svg, size = Svg(800, 430), 40
    left, right, top = 90, 450, 50
    y_of = lambda k: top + (cells - k) * size
    for k in range(cells + 1):
        svg.line((left, y_of(k)), (left + cells * size / 1.6, y_of(k)), GREY)
        svg.text((left - 34, y_of(k) + 5), f"k={k}", 13)
        svg.text((left + cells * size / 1.6 + 34, y_of(k) + 5), f"d={cache_depth(k, cells)}", 13, colour=RED if k == 0 else INK)
    for i in range(cells + 1):
        svg.line((left + i * size / 1.6, y_of(0)), (left + i * size / 1.6, y_of(cells)), GREY)
    svg.polygon([(left, y_of(level)), (left + cells * size / 1.6, y_of(level)), (left + cells * size / 1.6, y_of(level + 1)),
                 (left, y_of(level + 1))], BLUE, BLUE, 1.4, 0.3)
    draw_nodes(svg, cells, level, right, size, y_of)
    svg.text((left + 100, 24), f"march of {cells} levels, the third in blue", 13)
    svg.text((right + 115, 24), f"the {sum(octree_nodes(cells))} nodes around it, from the side", 13)
    svg.text((400, 410), f"{cached_corners(cells)} corners are kept, where all layers would have {(cells + 1)**3}.", 13)
    return str(svg)


def draw_nodes(svg, cells, level, right, size, y_of):
    """The nodes of each depth around a level, and the layers that they need."""
    colours = [INK, GREEN, RED, BLUE]
    for depth, (low, high) in reversed(list(enumerate(octree_layers(level, cells)))):
        span = cells >> depth
        for i in range(0, cells, span):
            svg.polygon([(right + i * size * 0.72, y_of(low)), (right + (i + span) * size * 0.72, y_of(low)),
                         (right + (i + span) * size * 0.72, y_of(high)), (right + i * size * 0.72, y_of(high))], "none",
                        colours[depth % 4], 1.0 + 0.9 * (3 - depth))
        for k in {low, high}:
            if cache_depth(k, cells) == depth:
                svg.text((right + cells * size * 0.72 + 46, y_of(k) + 5), f"k={k}: d={depth}", 13, colour=colours[depth % 4])


# ---------------------------------------------------------------------------------------------------------------------
# 4.1: local refinement
# ---------------------------------------------------------------------------------------------------------------------

def basis(t):
    """The four uniform cubic B-splines over a patch, at t in 0..1."""
    t = np.asarray(t, float)
    return np.stack([(1 - t)**3, 3 * t**3 - 6 * t**2 + 4, -3 * t**3 + 3 * t**2 + 3 * t + 1, t**3], -1) / 6


def points_on(net, u, v):
    """Points of the bicubic surface of a net (rows x columns x 3), u and v in patches."""
    net = np.asarray(net, float)
    i = np.clip(np.floor(u).astype(int), 0, net.shape[1] - 4)
    j = np.clip(np.floor(v).astype(int), 0, net.shape[0] - 4)
    a, b = basis(u - i), basis(v - j)
    near = net[j[:, None, None] + np.arange(4)[None, :, None], i[:, None, None] + np.arange(4)[None, None, :]]
    return np.einsum("nb,na,nbad->nd", b, a, near)


def refine_rows(net):
    """Inserts a knot in the middle of each interval of the first direction. m vertices become 2 m - 3."""
    net = np.asarray(net, float)
    on_old = (net[:-2] + 6 * net[1:-1] + net[2:]) / 8
    between = (net[:-1] + net[1:]) / 2
    refined = np.empty((2 * len(net) - 3, *net.shape[1:]))
    refined[0::2] = between
    refined[1::2] = on_old
    return refined


def refine(net):
    """Knot insertion in both directions. The surface stays the same (definition 4.1)."""
    return refine_rows(refine_rows(net).swapaxes(0, 1)).swapaxes(0, 1)


def bumpy_net():
    """The 5 x 5 vertices of the four patches around a vertex."""
    y, x = np.mgrid[-2:3, -2:3].astype(float)
    return np.stack([x + 0.08 * y, y, 0.7 * np.cos(0.9 * x) * np.cos(0.8 * y) - 0.12 * x], -1)


def local_refinement():
    net = bumpy_net()
    refined = refine(net)
    view = seen_from(28, 38, 120, (400, 250))
    svg = Svg(800, 520)
    for side in (0, 1):  # isolines of the surface: solid at the old knots, dashed at the new ones
        for at in np.linspace(0, 2, 5):
            along = np.linspace(0, 2, 41)
            u, v = (along, np.full(41, at)) if side else (np.full(41, at), along)
            is_old = at == round(at)
            svg.path(view(points_on(net, u, v)), INK if is_old else GREY, 1.8 if is_old else 1.2, "none" if is_old else "5 4")
    for point in view(refined).reshape(-1, 2):
        svg.cross(point, 4.5, BLUE)
    for point in view(net).reshape(-1, 2):
        svg.circle(point, 6, "none", RED, 1.6)
    svg.circle(view(net[2, 2]), 3, RED, RED)
    svg.text((400, 508), "circles: the 5 x 5 vertices of four patches; crosses: the 7 x 7 vertices of the same four patches, halved", 12)
    return str(svg)


# ---------------------------------------------------------------------------------------------------------------------
# A.1 to A.3: the tables of depths
# ---------------------------------------------------------------------------------------------------------------------

COLUMNS = [f"{build}_{sex}" for build in ("emaciated", "normal", "obese") for sex in ("male", "female")]


def depth_table(rows):
    """A table of depths in mm; the deeper, the darker. rows: (number, name, {column: mean or None})."""
    svg = Svg(800, 66 + 22 * len(rows))
    left, width = 250, 90
    for k, column in enumerate(COLUMNS):
        build, sex = column.split("_")
        svg.text((left + width * (k + 0.5), 40), sex, 12)
        if sex == "male":
            svg.text((left + width * (k + 1), 20), build, 13)
    for n, (number, name, means) in enumerate(rows):
        top = 50 + 22 * n
        svg.text((30, top + 16), number, 12, "end")
        svg.text((42, top + 16), name, 12, "start")
        for k, column in enumerate(COLUMNS):
            mean = means[column]
            share = 0 if mean is None else min(mean / 30, 1)
            fill = "#" + "".join(f"{round(255 - share * (255 - to)):02x}" for to in (47, 127, 193))
            svg.polygon([(left + width * k, top), (left + width * (k + 1), top), (left + width * (k + 1), top + 22), (left + width * k, top + 22)],
                        fill, "#ffffff", 1.0)
            svg.text((left + width * (k + 0.5), top + 16), "missing" if mean is None else f"{mean:.2f}", 12)
    return str(svg)
