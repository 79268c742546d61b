#!/usr/bin/python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes every figure and table of docs/thesis.md, and one page of them: make.py PROGRAM OUT [--only 3.4]...

Runs the program from the top folder of the source, and draws what it wrote. A complete run is not repeated unless the program or a
configuration has changed. The page is docs/thesis.md with the new pictures. Those of the source are replaced by hand, after a look at them:
cp OUT/figure-[2-5]* OUT/figure-1-2* OUT/table-* docs/thesis/"""
import argparse
import hashlib
import re
import subprocess
import sys
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent))
import diagrams  # noqa: E402
import draw  # noqa: E402
import shapes  # noqa: E402

ROOT = Path(__file__).resolve().parent.parent.parent
HEAD = "run docs/thesis/head.yaml"
# The thesis's truncation (3.2.2). Without it, the open skull's 350 thousand triangles take an hour.
OPEN_SKULL = "--set fill=none --set implicit.emitter.cut_below=0.002 --set implicit.tail_error=0.01"
DENSE = "--set implicit.target_triangles=10000000"

# Each run by the name of its folder in OUT. docs/thesis.md shows these commands, with out/thesis for OUT.
RUNS = {
    "sites": "landmarks page configs/tables/rhine_black.yaml configs/tables/rhine_caucasoid.yaml configs/tables/rhine_sw_indian.yaml",
    "skull": "import-ct /usr/share/doc/invesalius-examples/examples/Cranium.inv3 --edges half_maximum",
    "plane": "depth OUT/shapes/plane/plane.yaml",
    "tips": "depth docs/thesis/head.yaml --set fill=none --set outside=unassigned --set interp.max_angle_deg=90",
    "one": "run OUT/shapes/one/triangles.yaml",
    **{f"{name}-{decay}": f"run OUT/shapes/{name}-{decay}/triangles.yaml" for name in ("two", "three") for decay in (3, 6, 15)},
    "gaps-t0": f"{HEAD} {OPEN_SKULL} --set implicit.emitter.split=0",
    "gaps-t5": f"{HEAD} {OPEN_SKULL}",
    "filled-t0": f"{HEAD} --set implicit.emitter.split=0",
    "filled-t5": HEAD,
    "dense-t0": f"{HEAD} --set implicit.emitter.split=0 {DENSE}",
    "dense-t5": f"{HEAD} --set implicit.ends=open {DENSE}",
    "skin-t5": f"{HEAD} --set implicit.ends=open",
    "placed": "run docs/thesis/phantom.yaml --set face=placed",
    "standard": "run docs/thesis/phantom.yaml --set seeds=none",
    "inserted": "run docs/thesis/phantom.yaml",
    "touched_up": "run docs/thesis/touched_up.yaml",
    "builds": "run docs/thesis/builds.yaml",
}


class Maker:
    def __init__(self, program, out):
        self.program, self.out = Path(program).resolve(), Path(out).resolve()
        inputs = [self.program, ROOT / "docs/thesis/shapes.py", *sorted((ROOT / "docs/thesis").glob("*.yaml")), *sorted((ROOT / "configs").rglob("*.yaml"))]
        self.made_from = hashlib.sha256(b"".join(path.read_bytes() for path in inputs)).hexdigest()

    def run(self, name):
        """The folder of a run, which is made first if it is not there. Exit code 1 means that a face is not usable, and shapes and the
        thesis's own fit are not meant to be."""
        folder, key = self.out / name, f"{self.made_from} {RUNS[name]}"
        if (folder / "made_from").exists() and (folder / "made_from").read_text() == key:
            return folder
        start = time.monotonic()
        words = RUNS[name].replace("OUT", str(self.out)).split()
        quiet = [] if words[0] == "landmarks" else ["--quiet"]
        done = subprocess.run([self.program, *words, "--out", folder, "--force", *quiet], cwd=ROOT, stdout=subprocess.DEVNULL,
                              stderr=subprocess.PIPE, text=True)
        if done.returncode > 1:
            sys.exit(f"make.py: {RUNS[name]}: {done.stderr}")
        (folder / "made_from").write_text(key)
        print(f"  {name}: {time.monotonic() - start:.0f} s", flush=True)
        return folder

    def mesh(self, name, file="implicit.ply"):
        return draw.read_mesh(self.run(name) / file)

    def save(self, name, picture):
        """picture: SVG as text, or pixels."""
        if isinstance(picture, str):
            (self.out / f"{name}.svg").write_text(picture)
        else:
            draw.write_png(self.out / f"{name}.png", picture)


def table_rows(path):
    """(number, name, {column: mean or None}) of a tissue table of configs/tables."""
    rows = []
    for line in Path(path).read_text().splitlines():
        found = re.match(r"\s+(number|name|(?:emaciated|normal|obese)_\w+): (.*)", line)
        if found and found[1] == "number":
            rows.append([int(found[2]), "", {}])
        elif found and found[1] == "name":
            rows[-1][1] = found[2].strip('"')
        elif found:
            mean = re.match(r"\{mean: ([\d.]+|null)", found[2])[1]
            rows[-1][2][found[1]] = None if mean == "null" else float(mean)
    return rows


def plain_view(points, triangles, azimuth_deg, width, height, colours=draw.SKIN, flat=False):
    centre, scale = draw.in_frame(points, width, height, 0.84)
    picture = draw.Picture(width, height, centre, scale, azimuth_deg)
    picture.mesh(points, triangles, colours, flat)
    return picture.pixels()


# ---------------------------------------------------------------------------------------------------------------------
# The figures. Each function makes one and returns SVG or pixels.
# ---------------------------------------------------------------------------------------------------------------------

def landmarks(maker):
    return (maker.run("sites") / "sites.svg").read_text()


def digitised_skull(maker):
    points, triangles = maker.mesh("skull", "skull.ply")
    return draw.beside(*(plain_view(points, triangles, azimuth, 270, 260, draw.BONE) for azimuth in (0, 40, 90)))


def read_dowels(folder):
    """The bases of the dowels by site."""
    header, *lines = (folder / "dowels.csv").read_text().splitlines()
    names = header.split(",")
    rows = [dict(zip(names, line.split(","))) for line in lines]
    return {row["site"]: np.array([float(row[f"base_{axis}_mm"]) for axis in "xyz"]) for row in rows}


def network(maker):
    """The areas over the phantom's skull."""
    folder = maker.run("placed")
    points, triangles = draw.read_mesh(folder / "depth.ply")
    base = read_dowels(folder)
    areas = re.findall(r"^  - \[(.*)\]$", (ROOT / "configs/networks/standard32.yaml").read_text(), re.MULTILINE)
    edges = sorted({tuple(sorted(pair)) for area in areas for sites in [[site.strip('" ') for site in area.split(",")]]
                    for pair in zip(sites, sites[1:] + sites[:1])})
    views = []
    for azimuth in (0, 60):
        centre, scale = draw.in_frame(points, 380, 380, 0.86)
        picture = draw.Picture(380, 380, centre, scale, azimuth)
        picture.mesh(points, triangles, draw.BONE)
        # The straight edges run below the curved bone, so they are drawn nearer to the viewer.
        facing = [(a, b) for a, b in edges if all((base[s] - centre) @ picture.axes[2] > -12 for s in (a, b))]
        picture.lines([base[a] for a, _ in facing], [base[b] for _, b in facing], draw.BLUE, 30, 3)
        for site in {site for edge in facing for site in edge}:
            picture.ball(base[site] + 32 * picture.axes[2], 2.4)
        views.append(picture.pixels())
    return draw.beside(*views)


def plane(maker):
    """The depth on a plane, as a surface over it, with the four dowels."""
    points, triangles = draw.read_mesh(maker.run("plane") / "tips.ply")
    bone, bone_triangles = shapes.plane_mesh()
    picture = draw.Picture(640, 320, (0, 0, 5), 2.7, 28, 24)
    turned = lambda p: np.asarray(p, float)[:, [0, 2, 1]] * (1, 1, -1)   # the plane lies flat, and depth is up
    picture.mesh(turned(bone), np.asarray(bone_triangles), draw.BONE)
    upper = points[triangles].mean(1)[:, [0, 2]].sum(1) > 0
    picture.mesh(turned(points), triangles[upper], (226, 178, 150), True)
    picture.mesh(turned(points), triangles[~upper], (150, 186, 214), True)
    dowels = np.array([(x, 0, z) for x, z, _ in shapes.PLANE_DOWELS.values()], float)
    tips = dowels + np.array([(0, -depth, 0) for *_, depth in shapes.PLANE_DOWELS.values()])
    picture.rods(turned(dowels), turned(tips), 1.2)
    return picture.pixels()


def skull_and_depth(maker):
    """The skull, the skull moved by its depth, and the moved part alone."""
    folder = maker.run("tips")
    vertices, triangles = draw.read_ply(folder / "depth.ply")
    bone = draw.points_of(vertices)
    moved, part = draw.read_mesh(folder / "tips.ply")
    centre, scale = draw.in_frame(bone, 270, 250, 0.84)
    views = []
    for meshes in ([(bone, triangles, draw.BONE)], [(bone, triangles, draw.BONE), (moved, part, draw.SKIN)], [(moved, part, draw.SKIN)]):
        picture = draw.Picture(270, 250, centre, scale, 35)
        for mesh in meshes:
            picture.mesh(*mesh)
        views.append(picture.pixels())
    return draw.beside(*views)


def seen_shape(points, triangles, count, width, height, elevation_deg=-62.0):
    """A surface over triangles, with the triangles drawn through it."""
    picture = draw.Picture(width, height, (0, -18, 12 if count == 1 else 0), 1.1 if count == 1 else 0.95,
                           20 if count == 1 else 0, elevation_deg)
    picture.mesh(points, triangles)
    flat, corners = shapes.triangle_strip(count)
    edges = np.array([pair for t in corners for pair in zip(t, t[1:] + t[:1])])
    picture.lines(flat[edges[:, 0]], flat[edges[:, 1]], draw.INK, 200, 3)
    return picture.pixels()


def one_triangle(maker):
    points, triangles = maker.mesh("one")
    return draw.beside(seen_shape(points, triangles, 1, 300, 240), seen_shape(points, triangles, 1, 300, 240, -8.0))


def cut(points, triangles, x_mm):
    """The segments in which a mesh meets the plane of one x."""
    side = points[triangles][:, :, 0] - x_mm
    ends = []
    for k in range(3):
        a, b = triangles[:, k], triangles[:, (k + 1) % 3]
        t = side[:, k] / np.where(side[:, k] == side[:, (k + 1) % 3], np.inf, side[:, k] - side[:, (k + 1) % 3])
        crossed = side[:, k] * side[:, (k + 1) % 3] < 0
        ends.append(np.where(crossed[:, None], points[a] + t[:, None] * (points[b] - points[a]), np.nan))
    ends = np.stack(ends, 1)
    met = np.isfinite(ends[:, :, 0]).sum(1) == 2
    pairs = ends[met][np.isfinite(ends[met][:, :, 0])].reshape(-1, 2, 3)
    return pairs[:, 0], pairs[:, 1]


def section_of_three(points, triangles):
    """The cross section through three triangles, along the row."""
    turned, row = points[:, [2, 1, 0]], shapes.triangle_strip(3)[0][:, [2, 1, 0]]
    starts, ends = cut(turned, triangles[:, ::-1], 0.0)
    picture = draw.Picture(260, 110, (0, -16, 0), 0.78, 90)
    show = lambda p: np.column_stack([0 * p[:, 2], p[:, 2], -p[:, 1] - 16])
    picture.lines(show(starts), show(ends), draw.RED, 1, 4)
    left, right = row[:, 2].min() + shapes.SIDE_MM / 4, row[:, 2].max() - shapes.SIDE_MM / 4
    picture.lines(show(np.array([[0, 0, left]])), show(np.array([[0, 0, right]])), draw.INK, 1, 4)
    return picture.pixels()


def several_triangles(maker):
    """For each k: two triangles from above and from the side, and a section of three."""
    columns = []
    for decay in (3, 6, 15):
        two, three = maker.mesh(f"two-{decay}"), maker.mesh(f"three-{decay}")
        columns.append(draw.below(seen_shape(*two, 2, 260, 200, -48.0), seen_shape(*two, 2, 260, 84, -86.0), section_of_three(*three)))
    return draw.beside(*columns)


def filled_skull(maker):
    """Above the skull and its implicit faces, below those of the filled skull."""
    gaps, shell = maker.run("gaps-t5") / "depth.ply", maker.run("filled-t5") / "depth.ply"
    rows = []
    for mesh, names in ((gaps, ("gaps-t0", "gaps-t5")), (shell, ("filled-t0", "filled-t5"))):
        points, triangles = draw.read_mesh(mesh)
        faces = [draw.trimmed(draw.view_of_run(maker.run(name) / "pictures/implicit.png", 1), (0.06, 0.86)) for name in names]
        rows.append(draw.beside(plain_view(points, triangles, 40, 280, faces[0].shape[0], draw.BONE), *faces))
    return draw.below(*rows)


def close_up(points, triangles):
    """The face with the edges of the triangles, lit triangle by triangle."""
    picture = draw.Picture(400, 290, (132, -150, 48), 2.5, 30)
    picture.mesh(points, triangles, flat=True)
    picture.wires(points, triangles, (112, 84, 70))
    return picture.pixels()


def print_distances(maker, dense, fewer):
    """The distances of 2,000 vertices of the polygons from the decimated mesh, in mm."""
    points, polygons = maker.mesh(dense)
    corners, triangles = maker.mesh(fewer)
    chosen = np.random.default_rng(1).choice(len(points), min(2000, len(points)), replace=False)
    distances = np.array([draw.distance_mm(points[v], corners[triangles]) for v in chosen])
    print(f"  {len(polygons)} polygons to {len(triangles)} triangles: RMS {np.sqrt((distances**2).mean()):.3f} mm, "
          f"95 % within {np.quantile(distances, 0.95):.2f} mm", flush=True)


def fewer_triangles(maker):
    for pair in (("dense-t0", "filled-t0"), ("dense-t5", "skin-t5")):
        print_distances(maker, *pair)
    rows = [draw.beside(close_up(*maker.mesh(dense)), close_up(*maker.mesh(fewer)))
            for dense, fewer in (("dense-t0", "filled-t0"), ("dense-t5", "skin-t5"))]
    return draw.below(*rows)


def final_implicit(maker):
    points, triangles = maker.mesh("skin-t5")
    return draw.beside(*(plain_view(points, triangles, azimuth, 270, 250) for azimuth in (0, 40, 90)))


def generic_face(maker):
    folder = maker.run("placed")
    return draw.beside(draw.view_of_run(folder / "pictures/face_over_skull.png", 1), draw.view_of_run(folder / "pictures/face.png", 1))


def standard_dowels(maker):
    folder = maker.run("standard")
    return draw.beside(draw.view_of_run(folder / "pictures/fit.png", 1), draw.view_of_run(folder / "pictures/face.png", 1))


def inserted_dowels(maker):
    inserted, touched = maker.run("inserted"), maker.run("touched_up")
    return draw.beside(draw.view_of_run(inserted / "pictures/fit.png", 1), draw.view_of_run(inserted / "pictures/face.png", 1),
                       draw.view_of_run(touched / "pictures/face.png", 1))


def both_methods(maker):
    folder = maker.run("builds") / "pictures"
    return draw.beside(*(draw.view_of_run(folder / f"{name}.png", view) for name in ("implicit", "face") for view in (0, 1)))


def three_builds(maker, name):
    folder = maker.run("builds")
    parts = [folder / "alternatives/emaciated", folder, folder / "alternatives/obese"]
    return draw.beside(*(draw.view_of_run(part / f"pictures/{name}.png", 1) for part in parts))


FIGURES = {
    "figure-1-1": landmarks,
    "figure-1-2": digitised_skull,
    "figure-2-1": network,
    "figure-2-2": lambda maker: diagrams.cutting_plane(),
    "figure-2-3": plane,
    "figure-2-4": skull_and_depth,
    "figure-3-1": one_triangle,
    "figure-3-2": several_triangles,
    "figure-3-3": lambda maker: diagrams.cube_cases(),
    "figure-3-4": lambda maker: diagrams.emitter_cache(),
    "figure-3-5": filled_skull,
    "figure-3-6": fewer_triangles,
    "figure-3-7": final_implicit,
    "figure-4-1": lambda maker: diagrams.local_refinement(),
    "figure-4-2": generic_face,
    "figure-4-3": standard_dowels,
    "figure-4-4": inserted_dowels,
    "figure-5-1": both_methods,
    "figure-5-2": lambda maker: three_builds(maker, "implicit"),
    "figure-5-3": lambda maker: three_builds(maker, "face"),
    **{f"table-A-{n}": lambda maker, name=name: diagrams.depth_table(table_rows(ROOT / f"configs/tables/rhine_{name}.yaml"))
       for n, name in ((1, "caucasoid"), (2, "black"), (3, "sw_indian"))},
}


def write_shapes(out):
    shapes.write_plane(out / "shapes/plane")
    shapes.write_triangles(out / "shapes/one", 1, 6)
    for decay in (3, 6, 15):
        shapes.write_triangles(out / f"shapes/two-{decay}", 2, decay)
        shapes.write_triangles(out / f"shapes/three-{decay}", 3, decay)


def write_page(out):
    """docs/thesis.md with the pictures of `out`, as one page."""
    from markdown_it import MarkdownIt
    body = MarkdownIt("commonmark").enable("table").render((ROOT / "docs/thesis.md").read_text())
    body = body.replace('src="thesis/', 'src="').replace('src="reference/sites.svg"', 'src="figure-1-1.svg"')
    slug = lambda title: re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-")
    body = re.sub(r"<(h[23])>(.*?)</", lambda head: f'<{head[1]} id="{slug(head[2])}">{head[2]}</', body)
    body = re.sub(r'href="(?!http|#)([^"]*)"', lambda link: f'href="{(ROOT / "docs" / link[1]).as_uri()}"', body)
    page = ('<!doctype html>\n<html lang="en"><head><meta charset="utf-8"><title>The figures of the thesis</title><link rel="icon" href="data:,">'
            "<style>body { max-width: 60em; margin: 2em auto; padding: 0 1em; font: 16px/1.6 sans-serif } img { max-width: 100% }"
            " pre { background: #f4f6f8; padding: .8em; white-space: pre-wrap } td, th { padding: .2em .8em .2em 0; text-align: left }</style></head>\n"
            f"<body>\n{body}</body></html>\n")
    (out / "index.html").write_text(page)
    return out / "index.html"


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("program")
    parser.add_argument("out", type=Path)
    parser.add_argument("--only", action="append", default=[], metavar="NUMBER", help="a figure or table, e.g. 3.4 or A.1")
    arguments = parser.parse_args()
    if not Path(arguments.program).is_file():
        sys.exit(f"make.py: there is no program {arguments.program}; build it first")
    arguments.out.mkdir(parents=True, exist_ok=True)
    maker = Maker(arguments.program, arguments.out)
    write_shapes(maker.out)
    wanted = [number.replace(".", "-") for number in arguments.only]
    chosen = [name for name in FIGURES if not wanted or name.split("-", 1)[1] in wanted]
    if not chosen:
        sys.exit(f"make.py: no figure {', '.join(arguments.only)}; there are {', '.join(FIGURES)}")
    for name in chosen:
        print(name, flush=True)
        maker.save(name, FIGURES[name](maker))
    if not wanted:
        print(write_page(maker.out))


if __name__ == "__main__":
    main()
