#!/usr/bin/python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""The numbers of docs/thesis.md: each figure and table of the thesis that has one, by a closed form, by counting, or by a second copy.

usage: thesis_test.py PROGRAM SOURCE

A test is a function whose name begins with `figure` or `table`; it asserts. Skipped (77) if this Python has no numpy.
"""
import itertools
import json
import pathlib
import re
import subprocess
import sys
import tempfile
import time

try:
    import numpy as np
except ImportError:
    print("skipped: python3-numpy is not installed")
    sys.exit(77)

PROGRAM, SOURCE = pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2]).resolve()
sys.path.insert(0, str(SOURCE / "docs/thesis"))
import diagrams  # noqa: E402
import draw  # noqa: E402
import make  # noqa: E402
import shapes  # noqa: E402

OUT = pathlib.Path(tempfile.mkdtemp())


def program(*words, usable=True):
    """Runs the program, which may end with 1, a face that is not usable, if `usable` is false."""
    done = subprocess.run([PROGRAM, *map(str, words)], text=True, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    assert done.returncode == 0 or (done.returncode == 1 and not usable), done.stdout
    return done.stdout


def run(name, config, *settings):
    """A run's folder. Settings: PATH=VALUE."""
    folder = OUT / name
    program("run", config, "--out", folder, "--quiet", "--force", *(word for setting in settings for word in ("--set", setting)), usable=False)
    return folder


def result(folder):
    return json.loads((folder / "result.json").read_text())


def near(found, expected, tolerance, what=""):
    difference = np.max(np.abs(np.asarray(found, float) - np.asarray(expected, float)))
    assert difference <= tolerance, f"{what}: {found} is {difference:.3g} from {expected}, and {tolerance} is allowed"


# A phantom that is small enough for a test.
SMALL = ("subject={type: phantom, rings: 20}", "implicit.resolution=24", "template.max_level=2",
         "fit.plan.schedule=[{level: 0, fraction: 1}, {level: 1, fraction: 1}]")


def figure_1_1():
    """21 sites of the tables make 32 dowels: 10 in the midline, 11 on each side."""
    rows = make.table_rows(SOURCE / "configs/tables/rhine_caucasoid.yaml")
    text = (SOURCE / "configs/networks/standard32.yaml").read_text()
    sites = {site.strip('" ') for area in re.findall(r"^  - \[(.*)\]$", text, re.MULTILINE) for site in area.split(",")}
    assert [number for number, *_ in rows] == list(range(1, 22))
    assert len(sites) == 32 and sum(site[-2:] in ("_l", "_r") for site in sites) == 22, sites


def figure_2_1():
    """The network is one piece with one border: a disc, so vertices - edges + areas is 1. Each edge has one area or two."""
    text = (SOURCE / "configs/networks/standard32.yaml").read_text()
    areas = [[site.strip('" ') for site in area.split(",")] for area in re.findall(r"^  - \[(.*)\]$", text, re.MULTILINE)]
    uses = {}
    for area in areas:
        for pair in itertools.combinations(sorted(area), 2):
            uses[pair] = uses.get(pair, 0) + 1
    assert len(areas) == 54 and set(uses.values()) == {1, 2}, (len(areas), uses)
    assert 32 - len(uses) + len(areas) == 1


def figure_2_2():
    """The cutting plane holds both bases and is parallel to the sum of the directions."""
    random = np.random.default_rng(1)
    for base_i, direction_i, base_j, direction_j in random.normal(size=(20, 4, 3)):
        normal = diagrams.cutting_plane_normal(base_i, direction_i, base_j, direction_j)
        near([normal @ (base_j - base_i), normal @ (direction_i + direction_j), normal @ normal], [0, 0, 1], 1e-12)


def figure_2_3():
    """On a plane the program's depth is the linear function of each triangle, at every vertex, and no depth outside."""
    config = shapes.write_plane(OUT / "plane")
    program("depth", config, "--out", OUT / "depth", "--quiet", "--force")
    vertices, _ = draw.read_ply(OUT / "depth/depth.ply")
    front = np.abs(vertices["y"]) < 1e-6
    expected = shapes.plane_depth(vertices["x"], vertices["z"])[front]
    found = vertices["scalar_depth_mm"][front]
    assert (np.isfinite(found) == np.isfinite(expected)).all() and np.isfinite(expected).sum() == 61 * 61, "vertices with a depth"
    near(found[np.isfinite(found)], expected[np.isfinite(expected)], 1e-5, "depth, mm")
    tips, _ = draw.read_mesh(OUT / "depth/tips.ply")
    near([-tips[:, 1].max(), -tips[:, 1].min()], [4, 30], 1e-4, "least and greatest height, mm")


def triangles(count, decay, name, *settings):
    """The folder of a run of figures 3.1 and 3.2. A run is made once."""
    if (OUT / f"{name}-{count}-{decay}").exists():
        return OUT / f"{name}-{count}-{decay}"
    return run(f"{name}-{count}-{decay}", shapes.write_triangles(OUT / f"shape-{count}-{decay}", count, decay, 60), *settings)


def triangle_extent(count, decay):
    points, _ = draw.read_mesh(triangles(count, decay, "dense") / "implicit.ply")
    return points.min(0), points.max(0)


def figure_3_1():
    """One triangle: a prism of its depth, cylinders along its edges and balls at its corners, cut off in its plane."""
    low, high = triangle_extent(1, 6)
    corners, _ = shapes.triangle_strip(1)
    depth = shapes.DEPTH_MM
    near(low, [corners[:, 0].min() - depth, -depth, corners[:, 2].min() - depth], 0.1, "low corner, mm")
    near(high, [corners[:, 0].max() + depth, 0, corners[:, 2].max() + depth], 0.1, "high corner, mm")


def figure_3_2():
    """Two triangles: over the middle of their common edge both emit (l/h)^k, so the surface is at l 2^(1/k). The bulge falls with k."""
    heights = [-triangle_extent(2, decay)[0][1] for decay in (3, 6, 15)]
    near(heights, [shapes.DEPTH_MM * 2**(1 / decay) for decay in (3, 6, 15)], 0.1, "height over the common edge, mm")


def figure_3_3():
    """256 patterns are 15 by rotation and inversion, 23 by rotation alone (Burnside's count), and every outline closes."""
    classes = diagrams.cube_classes()
    assert len(classes) == 15 and sorted(p for members in classes for p in members) == list(range(256)), list(map(len, classes))
    turns = diagrams.cube_rotations()
    cycles = [sum(1 for _ in cycle_starts(turn)) for turn in turns]
    assert len(turns) == 24 and len(diagrams.cube_classes(False)) == sum(2**n for n in cycles) // 24 == 23
    crossed = [sum((p >> a & 1) != (p >> b & 1) for a, b in diagrams.EDGES) for p in range(256)]
    assert [sum(map(len, diagrams.case_loops(p))) for p in range(256)] == crossed


def cycle_starts(turn):
    """The least member of each cycle of a permutation."""
    for start in range(len(turn)):
        at, members = int(turn[start]), {start}
        while at not in members:
            members.add(at)
            at = int(turn[at])
        if start == min(members):
            yield start


def figure_3_4():
    """Each corner layer that a level of the march needs has a slot of its own, but for layers 0 and n: both have depth 0."""
    for cells in (2, 4, 8, 16, 64, 256):
        for level in range(cells):
            needed = sorted({k for pair in diagrams.octree_layers(level, cells) for k in pair})
            slots = [diagrams.cache_depth(k, cells) for k in needed]
            assert needed[0] == 0 and needed[-1] == cells and slots[0] == slots[-1] == 0, (cells, level, needed, slots)
            assert len(set(slots)) == len(slots) - 1 == cells.bit_length(), (cells, level, slots)
    assert sum(diagrams.octree_nodes(8)) == 85 and diagrams.cached_corners(8) == 405 and (8 + 1)**3 == 729


def figure_3_4_of_the_program():
    """The program's cache gives the same mesh with fewer evaluations than corners without it."""
    counts, meshes = [], []
    for minimum in ("corners", "cached_corners"):
        folder = triangles(3, 6, f"march-{minimum}", "implicit.resolution=30", "implicit.edges.method=bisection", "implicit.tail_error=0",
                           "implicit.emitter.cut_below=0.002",
                           f"implicit.polygonizer={{type: minmax_octree, least_emission: 0.002, minimum: {minimum}}}")
        counts.append(result(folder)["implicit"]["bound_evaluations"] + result(folder)["implicit"]["emitter_evaluations"])
        meshes.append((folder / "implicit.ply").read_bytes())
    assert meshes[0] == meshes[1]
    assert counts[1] < counts[0], counts


def figure_3_6():
    """Decimation reaches its number, and the bound that it states holds at every vertex of the polygons."""
    polygons, decimated = triangles(1, 6, "dense"), triangles(1, 6, "decimated", "implicit.target_triangles=1400")
    counts = result(decimated)["implicit"]
    points, dense = draw.read_mesh(polygons / "implicit.ply")
    fewer, corners = draw.read_mesh(decimated / "implicit.ply")
    assert counts["triangles_dense"] == len(dense) and counts["triangles"] == len(corners) == 1400, counts
    assert draw.genus(dense) == draw.genus(corners) == 0, (draw.genus(dense), draw.genus(corners))
    sample = points[::max(1, len(points) // 300)]
    farthest = max(draw.distance_mm(point, fewer[corners]) for point in sample)
    assert farthest <= counts["decimation_error_mm"] + 1e-3, (farthest, counts)


def figure_4_1():
    """A refined net gives the same surface, by de Boor's recursion, which the diagram does not use; and 5 x 5 vertices become 7 x 7."""
    net = diagrams.bumpy_net()
    refined = diagrams.refine(net)
    assert net.shape == (5, 5, 3) and refined.shape == (7, 7, 3)
    for u, v in np.random.default_rng(2).uniform(0, 2, (50, 2)):
        near(de_boor(refined, 2 * u, 2 * v), de_boor(net, u, v), 1e-12, "point of the refined surface")
        near(diagrams.points_on(net, np.array([u]), np.array([v]))[0], de_boor(net, u, v), 1e-12, "point of the surface")


def de_boor(net, u, v):
    """A point of a uniform bicubic surface, u and v in patches."""
    def curve(vertices, t):
        first = min(int(t), len(vertices) - 4)
        points = [np.asarray(p, float) for p in vertices[first:first + 4]]
        for r in range(1, 4):
            for j in range(3, r - 1, -1):
                share = (t - (first + j - 3)) / (4 - r)
                points[j] = (1 - share) * points[j - 1] + share * points[j]
        return points[3]
    return curve([curve(row, u) for row in net], v)


def figure_4_3():
    """The standard dowels alone leave vertices of finer levels without a datum: of 19 x 19 at level 1 the fit moves less than half."""
    folder = run("standard", SOURCE / "docs/thesis/phantom.yaml", *SMALL, "seeds=none")
    levels = result(folder)["fit"]["levels"]
    assert levels[1]["level"] == 1 and 0 < levels[1]["moved_vertices"] < 19 * 19 / 2, levels


def figure_5_2():
    """Three builds in one run: more tissue, more volume, for both methods."""
    folder = run("builds", SOURCE / "docs/thesis/builds.yaml", *SMALL, "fill=none", "region.exclude=[]", "implicit.ends=closed")
    folders = [folder / "alternatives/emaciated", folder, folder / "alternatives/obese"]
    for measure in (implicit_volume_cm3, face_reach_mm):
        found = [measure(part) for part in folders]
        assert 1.005 * found[0] < found[1] < found[2] / 1.005, (measure.__name__, found)


def implicit_volume_cm3(folder):
    points, faces = draw.read_mesh(folder / "implicit.ply")
    a, b, c = (points[faces[:, k]] for k in range(3))
    return np.einsum("nd,nd->", a, np.cross(b, c)) / 6000


def face_reach_mm(folder):
    """The mean distance of the face's vertices from a vertical axis 80 mm behind nasion."""
    points, _ = draw.read_mesh(folder / "face.ply")
    return np.linalg.norm(points[:, :2] - (0, 80), axis=1).mean()


# A second copy of rows of the thesis, in the order of diagrams.COLUMNS. None: not in the text.
ROWS = {
    "caucasoid": {1: [2.25, 2.50, 4.25, 3.50, 5.50, 4.25], 9: [7.00, 8.50, 11.25, 10.00, 14.00, 14.25], 14: [8.50, 7.00, 13.25, 12.75, 15.25, 14.00],
                  18: [4.50, 5.00, 11.50, 12.00, 17.50, 17.50], 21: [None, None, 16.00, 15.50, 19.75, 18.75]},
    "black": {1: [4.00, 5.00, 5.00, 4.50, 5.00, 3.50], 7: [13.75, 12.25, 15.50, 15.00, 15.50, 12.00], 18: [11.50, 11.00, 13.00, 13.50, 24.00, 17.50],
              20: [16.75, 17.75, 19.00, 19.25, 30.00, 20.00], 21: [13.50, 14.25, 16.50, 17.00, 23.50, 20.00]},
    "sw_indian": {3: [5.75, 6.50, 6.86, 7.00, 6.50, 5.00], 5: [7.50, 10.00, 9.75, 10.00, 9.25, 8.51], 11: [4.75, 4.75, 4.25, 4.00, 4.50, 4.20],
                  18: [7.75, 6.25, 13.25, 10.50, 15.40, 12.75], 21: [12.50, 10.50, 19.25, 17.00, 18.50, 15.75]},
}


def table_A_1_to_3():
    """The shipped tables hold the thesis's numbers; the cells that are no quarters of a millimetre are the four that the thesis doubts; and
    the rows in which depth does not grow with build are as many as we say."""
    not_growing = {}
    for name, copied in ROWS.items():
        path = SOURCE / f"configs/tables/rhine_{name}.yaml"
        rows = {number: means for number, _, means in make.table_rows(path)}
        assert sorted(rows) == list(range(1, 22)) and all(sorted(means) == sorted(diagrams.COLUMNS) for means in rows.values())
        for number, expected in copied.items():
            assert [rows[number][column] for column in diagrams.COLUMNS] == expected, (name, number)
        means = [mean for row in rows.values() for mean in row.values() if mean is not None]
        assert len(means) == (124 if name == "caucasoid" else 126)
        odd = sorted(mean for mean in means if mean * 4 % 1)
        assert odd == ([4.20, 6.86, 8.51, 15.40] if name == "sw_indian" else []), odd
        assert path.read_text().count("flag: suspect") == len(odd)
        builds = [[[row[f"{build}_{sex}"] for build in ("emaciated", "normal", "obese")] for sex in ("male", "female")] for row in rows.values()]
        not_growing[name] = sum(any(None not in three and three != sorted(three) for three in row) for row in builds)
    assert not_growing == {"caucasoid": 0, "black": 9, "sw_indian": 13}, not_growing


def document():
    """Each figure and table has a section, a picture of the source, and commands that make.py runs."""
    text = (SOURCE / "docs/thesis.md").read_text()
    commands = {"semblance " + words.replace("OUT", "out/thesis") + f" --out out/thesis/{name}" for name, words in make.RUNS.items()}
    shown = set(re.findall(r"^    (semblance .*)$", text, re.MULTILINE))
    assert shown == commands, f"only in the document: {shown - commands}; only in make.py: {commands - shown}"
    for name in make.FIGURES:
        place = r"reference/sites\.svg" if name == "figure-1-1" else rf"thesis/{name}\.(svg|png)"
        assert re.search(rf"\]\({place}\)", text), f"no picture {name}"
    pictures = [*(SOURCE / "docs/thesis").glob("*.png"), *(SOURCE / "docs/thesis").glob("*.svg")]
    assert sum(path.stat().st_size for path in pictures) <= 1.1e6
    assert len(text.split()) <= 2000


def main():
    tests = [test for name, test in globals().items() if name.startswith(("figure", "table")) or name == "document"]
    faults = 0
    for test in tests:
        start = time.monotonic()
        try:
            test()
            fault = ""
        except AssertionError as error:
            fault = f": FAILED: {error}"
            faults += 1
        print(f"{test.__name__} ({time.monotonic() - start:.1f} s){fault}", flush=True)
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
