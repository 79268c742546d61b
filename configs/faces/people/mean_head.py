#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes the mean head of 54 people as a subject with a known skin, for `semblance recentre`.

    python3 configs/faces/people/mean_head.py POPULATION ICT_HEAD.ply FOLDER
    semblance recentre FOLDER/head.yaml --mean --mean_prior 0.1 --site_prior 1e6 --out OUT

makes head.hspline.json beside this file: the generic face without the bias of its mean, which is too
full at the cheek bones, temples and lower lip, and too flat beside the nose. It differs from the
model's own by 0.8 mm RMS, at most 2.6.

POPULATION holds joint_model/, made from 54 head CTs of OpenKBP (NOTICE names source and licence):
the mean facial bone with the 32 sites in its last rows, and the mean skin at vertices of the
neutral head of ICT-FaceKit, ICT_HEAD.ply. No single head is in it. FOLDER gets skull.ply, skin.ply,
landmarks.yaml and head.yaml.

1. Skin: the neutral head, moved so that the vertices whose mean is known lie at their mean, and the
   vertices between them smoothly along.
2. Skull: configs/mean_skull, laid on the mean facial bone.
3. Depths: from each site along the bone's normal to this skin.
"""
import csv
import pathlib
import sys

import numpy as np
from scipy.interpolate import RBFInterpolator
from scipy.spatial import cKDTree

ROOT = pathlib.Path(__file__).parents[3]
NEAR_MM = 7  # skin farther than this from all vertices whose mean is known is left out


def read_ply(path):
    """Returns the points (float32) and triangles of a binary PLY."""
    head, data = path.read_bytes().split(b"end_header\n", 1)
    count = {line.split()[1]: int(line.split()[2])
             for line in head.decode("latin-1").splitlines() if line.startswith("element")}
    points = np.frombuffer(data, "<f4", 3 * count["vertex"]).reshape(-1, 3).astype(float)
    faces = np.frombuffer(data, np.dtype([("n", "u1"), ("i", "<i4", 3)]), count["face"],
                          12 * count["vertex"])
    return points, faces["i"]


def read_off(path):
    lines = [line for line in path.read_text().split("\n") if not line.startswith("#")]
    points, faces = (int(n) for n in lines[1].split()[:2])
    return (np.array([line.split() for line in lines[2:2 + points]], float),
            np.array([line.split()[1:] for line in lines[2 + points:2 + points + faces]], int))


def write_ply(path, points, triangles):
    with path.open("w") as file:
        file.write("ply\nformat ascii 1.0\nelement vertex %d\nproperty float x\nproperty float y\n"
                   "property float z\nelement face %d\nproperty list uchar int vertex_indices\n"
                   "end_header\n" % (len(points), len(triangles)))
        for point in points:
            file.write("%.4f %.4f %.4f\n" % tuple(point))
        for triangle in triangles:
            file.write("3 %d %d %d\n" % tuple(triangle))


def similarity(source, target):
    """Umeyama (1991): the matrix A and the shift b that minimise |A source + b - target|."""
    a, b = source.mean(0), target.mean(0)
    u, d, vt = np.linalg.svd((target - b).T @ (source - a))
    sign = np.array([1, 1, np.sign(np.linalg.det(u @ vt))])
    matrix = (u * sign) @ vt * ((d * sign).sum() / ((source - a) ** 2).sum())
    return matrix, b - matrix @ a


def mean_skin(neutral, triangles, known, where):
    """The neutral head with its vertices `known` at `where`, as far as these reach."""
    matrix, shift = similarity(neutral[known], where)
    skin = neutral @ matrix.T + shift
    near = cKDTree(skin[known]).query(skin)[0] < NEAR_MM
    skin[near] += RBFInterpolator(skin[known], where - skin[known], neighbors=40,
                                  kernel="thin_plate_spline", smoothing=0.5)(skin[near])
    used, compact = np.unique(triangles[near[triangles].all(1)], return_inverse=True)
    return skin[used], compact.reshape(-1, 3)


def lay_on(points, starts, ends, bone):
    """Lays points on the bone: by their sites first, then by the closest four fifths."""
    matrix, shift = similarity(starts, ends)
    for _ in range(30):
        distance, nearest = cKDTree(points @ matrix.T + shift).query(bone)
        kept = distance < np.quantile(distance, 0.8)
        matrix, shift = similarity(points[nearest[kept]], bone[kept])
    return points @ matrix.T + shift


def closest_on(points, triangles, places):
    """The closest of 40 random points in each triangle: to some tenths of a millimetre."""
    weights = np.random.default_rng(1).dirichlet([1, 1, 1], 40)
    dense = np.einsum("kc,tcx->tkx", weights, points[triangles]).reshape(-1, 3)
    return dense[cKDTree(dense).query(places)[1]]


def first_hit(origin, direction, points, triangles):
    """Moeller and Trumbore (1997): the distance to the first triangle along a ray."""
    corner, b, c = (points[triangles[:, k]] for k in range(3))
    normal = np.cross(direction, c - corner)
    scale = ((b - corner) * normal).sum(1)
    scale[np.abs(scale) < 1e-12] = np.nan
    u = ((origin - corner) * normal).sum(1) / scale
    turned = np.cross(origin - corner, b - corner)
    v = (turned * direction).sum(1) / scale
    t = ((c - corner) * turned).sum(1) / scale
    return t[(u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0)].min()


def main():
    model, out = pathlib.Path(sys.argv[1]) / "joint_model", pathlib.Path(sys.argv[3])
    out.mkdir(parents=True, exist_ok=True)
    load = lambda name: np.load(model / (name + ".npy"))
    bone, normals = load("bone_points_mm").astype(float), load("bone_normals").astype(float)
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    neutral, triangles = read_ply(pathlib.Path(sys.argv[2]))
    skin, skin_triangles = mean_skin(neutral, triangles, load("skin_ict_vertex"),
                                     load("skin_points_mm").astype(float))
    write_ply(out / "skin.ply", skin, skin_triangles)
    skull, skull_triangles = read_off(ROOT / "configs/mean_skull/mean.off")
    with (ROOT / "configs/mean_skull/sites.csv").open() as file:
        on_skull = {row["site"]: [float(row[c]) for c in "xyz"] for row in csv.DictReader(file)}
    first = len(bone) - len(on_skull)
    skull = lay_on(skull, np.array(list(on_skull.values())), bone[first:], bone[:first])
    write_ply(out / "skull.ply", skull, skull_triangles)
    with (out / "landmarks.yaml").open("w") as file:
        file.write("subject: mean head\nunits: mm\naxes: LPS\nlandmarks:\n")
        places = closest_on(skull, skull_triangles, bone[first:])
        for site, place, normal in zip(on_skull, places, normals[first:]):
            depth = first_hit(place, normal, skin, skin_triangles)
            file.write("  - {site: %s, point: [%.3f, %.3f, %.3f], normal: [%.4f, %.4f, %.4f], "
                       "depth_along_normal_mm: %.3f, depth_closest_mm: %.3f}\n"
                       % (site, *place, *normal, depth, depth))
    (out / "head.yaml").write_text(
        "title: mean head of 54 people\n"
        "subject: {type: files, skull: skull.ply, skin: skin.ply, landmarks: landmarks.yaml}\n"
        "tissue: {depths: measured}\n"
        "network: %s\n"
        "template: {type: ict, mean: model}\nprior: ict\nface: prior\n" % (ROOT / "configs/networks/standard32.yaml"))


if __name__ == "__main__":
    main()
