# SPDX-License-Identifier: GPL-3.0-or-later
"""Small shapes in the place of a skull: a plane with four dowels (figure 2.3) and a few triangles (figures 3.1 and 3.2). Each becomes a folder
with a mesh, landmarks and a configuration, which the program reads like those of a head."""
import numpy as np

SIDE_MM = 120.0       # of the triangles; the program refuses meshes that are much smaller than a head
DEPTH_MM = 36.0       # of every dowel of the triangles
PLANE_MM = 160.0      # width and height of the plane
PLANE_CELLS = 80
# x, z and depth in mm of the plane's dowels. The names are those of sites at such places on a head; they have no further meaning here.
PLANE_DOWELS = {"fe_r": (-60.0, 60.0, 6.0), "fe_l": (60.0, 60.0, 18.0), "go_l": (60.0, -60.0, 4.0), "go_r": (-60.0, -60.0, 30.0)}
PLANE_AREAS = [("fe_r", "go_r", "go_l"), ("fe_r", "go_l", "fe_l")]
FRONT = np.array([0.0, -1.0, 0.0])   # the face of a head looks to -y


def write_off(path, points, triangles):
    lines = ["OFF", f"{len(points)} {len(triangles)} 0"]
    lines += [" ".join(f"{value:.9g}" for value in point) for point in points]
    lines += [f"3 {a} {b} {c}" for a, b, c in triangles]
    path.write_text("\n".join(lines) + "\n")


def write_landmarks(path, landmarks):
    """landmarks: (site, point, normal, depth in mm)."""
    row = lambda values: "[" + ", ".join(f"{value:.9g}" for value in values) + "]"
    lines = ["subject: shape", "units: mm", "axes: LPS", "landmarks:"]
    for site, point, normal, depth_mm in landmarks:
        lines += [f'  - site: "{site}"', f"    point: {row(point)}", f"    normal: {row(normal)}", f"    depth_along_normal_mm: {depth_mm:.9g}"]
    path.write_text("\n".join(lines) + "\n")


def write_network(path, areas):
    rows = "".join("  - [" + ", ".join(f'"{site}"' for site in area) + "]\n" for area in areas)
    path.write_text(f"area_count: {len(areas)}\nareas:\n{rows}")


def with_back(points, triangles, outline):
    """Closes an open sheet by a copy 1 mm behind it. The program refuses a mesh that shows the backs of triangles from half of all sides.
    outline: the border's vertices in order, counter-clockwise seen from outside."""
    count = len(points)
    behind = [(a + count, c + count, b + count) for a, b, c in triangles]
    rim = []
    for a, b in zip(outline, np.roll(outline, -1)):
        rim += [(b, a, a + count), (b, a + count, b + count)]
    return np.vstack([points, points - FRONT]), [*triangles, *behind, *rim]


def plane_mesh():
    """A square in the plane y = 0 that faces -y, and its back. Its cells are halved along the direction of the line between the two areas."""
    side = np.linspace(-PLANE_MM / 2, PLANE_MM / 2, PLANE_CELLS + 1)
    x, z = np.meshgrid(side, side)
    points = np.column_stack([x.ravel(), np.zeros(x.size), z.ravel()])
    triangles = []
    for row in range(PLANE_CELLS):
        for column in range(PLANE_CELLS):
            a = row * (PLANE_CELLS + 1) + column
            b, c, d = a + 1, a + PLANE_CELLS + 2, a + PLANE_CELLS + 1
            triangles += [(a, b, d), (b, c, d)]
    first, last, step = 0, (PLANE_CELLS + 1)**2 - 1, PLANE_CELLS + 1
    outline = [*range(first, PLANE_CELLS), *range(PLANE_CELLS, last, step), *range(last, last - PLANE_CELLS, -1), *range(last - PLANE_CELLS, 0, -step)]
    return with_back(points, triangles, outline)


def write_plane(folder):
    """Figure 2.3. Returns the configuration's path."""
    folder.mkdir(parents=True, exist_ok=True)
    write_off(folder / "plane.off", *plane_mesh())
    write_landmarks(folder / "landmarks.yaml", [(site, (x, 0, z), FRONT, depth_mm) for site, (x, z, depth_mm) in PLANE_DOWELS.items()])
    write_network(folder / "network.yaml", PLANE_AREAS)
    config = folder / "plane.yaml"
    config.write_text("""title: "A plane with four dowels"
subject: {type: files, skull: plane.off, landmarks: landmarks.yaml}
tissue: {depths: measured}
network: network.yaml
interp: {type: barycentric, distance: plane, max_angle_deg: 90}
outside: unassigned
fill: none
""")
    return config


def plane_depth(x, z):
    """The depth on the plane in closed form: linear in each of the two triangles, NaN outside both."""
    def linear(corners):
        rows = [PLANE_DOWELS[site] for site in corners]
        matrix = np.array([[a, b, 1.0] for a, b, _ in rows])
        return np.linalg.solve(matrix, [depth for _, _, depth in rows])
    x, z = np.asarray(x, float), np.asarray(z, float)
    lower, upper = (linear(area) for area in PLANE_AREAS)
    depth = np.where(x + z <= 0, lower[0] * x + lower[1] * z + lower[2], upper[0] * x + upper[1] * z + upper[2])
    return np.where(np.maximum(abs(x), abs(z)) <= 60, depth, np.nan)


def triangle_strip(count):
    """One, two or three equilateral triangles in a row, in the plane y = 0, facing -y."""
    height = SIDE_MM * np.sqrt(0.75)
    points = np.array([(0.5 * SIDE_MM * n, 0.0, height * (n % 2)) for n in range(count + 2)])
    points -= points.mean(0)
    triangles = [(n, n + 1, n + 2) if n % 2 else (n, n + 2, n + 1) for n in range(count)]
    facing = [np.cross(points[b] - points[a], points[c] - points[a]) @ FRONT > 0 for a, b, c in triangles]
    return points, [t if faces else (t[0], t[2], t[1]) for t, faces in zip(triangles, facing)]


def write_triangles(folder, count, decay, resolution=90):
    """Figures 3.1 and 3.2: triangles of one depth, with the emitter of equation 3.1. Returns the configuration's path."""
    folder.mkdir(parents=True, exist_ok=True)
    points, triangles = triangle_strip(count)
    outline = [0, 2, 1] if count == 1 else [0, 2, 3, 1] if count == 2 else [0, 2, 4, 3, 1]
    write_off(folder / "triangles.off", *with_back(points, triangles, outline))
    # Vertices of the back have no depth, so that nothing but the front emits.
    depths = ["scalar_depth_mm"] + [f"{DEPTH_MM}"] * len(points) + ["nan"] * len(points)
    (folder / "depth.csv").write_text("\n".join(depths) + "\n")
    write_landmarks(folder / "landmarks.yaml", [(site, point, FRONT, DEPTH_MM) for site, point in zip(["zy_r", "n", "zy_l"], points)])
    write_network(folder / "network.yaml", [("zy_r", "zy_l", "n")])
    config = folder / "triangles.yaml"
    config.write_text(f"""title: "{count} triangles, k = {decay}"
subject: {{type: files, skull: triangles.off, landmarks: landmarks.yaml}}
tissue: {{depths: measured}}
network: network.yaml
interp: {{type: depth_map, file: depth.csv, reach_mm: 0.5}}
outside: unassigned
fill: none
implicit: {{emitter: {{type: thesis, decay: {decay}}}, resolution: {resolution}, target_triangles: 10000000}}
template: {{type: formula, max_level: 0}}
prior: none
bust: none
face: placed
first_fit: []
seeds: none
fit: {{plan: {{type: listed, schedule: [{{level: 0, fraction: 1}}]}}}}
uncertainty: {{sigma: false}}
""")
    return config
