#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes the study of 64 and 128 markers on the phantoms of schemes_on_people.yaml, which have only 32 sites.

    dense_phantoms.py PROGRAM FOLDER     # then: PROGRAM study FOLDER/dense_phantoms.yaml --out ...

The further markers are farthest points of the compared bone: each is the vertex farthest from the sites and the points before it. They
have the true depth along the bone's mean normal within 3 mm, which is the direction of an inserted marker.
"""
import csv
import pathlib
import re
import subprocess
import sys

import numpy as np

SEEDS = range(71, 91)  # those of schemes_on_people.yaml
COUNTS = (64, 128)
STUDIES = pathlib.Path(__file__).resolve().parent
SCHEMES = re.search(r"interp: (\[.*\])", (STUDIES / "schemes_on_people.yaml").read_text())[1]


def vertices(path):
    """The vertices of a binary PLY file as a structured array."""
    data = path.read_bytes()
    head, body = data.split(b"end_header\n", 1)
    lines = head.decode().split("\n")
    count = next(int(line.split()[2]) for line in lines if line.startswith("element vertex"))
    names = [line.split()[2] for line in lines if line.startswith("property float")]
    return np.frombuffer(body[: count * 4 * len(names)], dtype=[(name, "<f4") for name in names])


def truth(program, seed, folder):
    """The compared bone with its true depths, and the sites' points."""
    out = folder / f"truth_{seed}"
    subprocess.run([program, "depth", STUDIES.parent / "phantom.yaml", "--set", "subject.bone=like_people", "--set",
                    f"subject.random_seed={seed}", "--set", "direction={type: smoothed_normal, radius_mm: 3}", "--set",
                    "depth_truth.max_depth_mm=40", "--set", "interp=nearest", "--out", out, "--quiet", "--force"],
                   check=True, stdout=subprocess.DEVNULL)
    bone = vertices(out / "depth.ply")
    scored = bone[np.isfinite(bone["scalar_error_along_direction_mm"])]
    with open(out / "dowels.csv") as file:
        sites = [[float(row[f"base_{axis}_mm"]) for axis in "xyz"] for row in csv.DictReader(file)]
    return np.column_stack([scored[axis] for axis in "xyz"]).astype(float), scored["scalar_true_along_direction_mm"], np.array(sites)


def farthest(points, sites, count):
    """The indices of `count` points, each farthest from the sites and the points before it."""
    away = np.linalg.norm(points[:, None] - sites, axis=2).min(axis=1)
    chosen = []
    for _ in range(count):
        chosen.append(int(np.argmax(away)))
        away = np.minimum(away, np.linalg.norm(points - points[chosen[-1]], axis=1))
    return chosen


def main():
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    program, folder = sys.argv[1], pathlib.Path(sys.argv[2])
    folder.mkdir(parents=True, exist_ok=True)
    lines = [f"base: {STUDIES.parent / 'phantom.yaml'}", "job: depth", "set: {depth_truth.max_depth_mm: 40}", "subjects:"]
    for seed in SEEDS:
        points, depth_mm, sites = truth(program, seed, folder)
        chosen = farthest(points, sites, max(COUNTS) - len(sites))
        for count in COUNTS:
            further = ", ".join(f"d{n:03d}: {{near: [{', '.join(f'{x:.1f}' for x in points[k])}], depth: {depth_mm[k]:.2f}}}"
                                for n, k in enumerate(chosen[:count - len(sites)], 1))
            lines.append(f'  - {{name: "phantom {seed}, {count}", set: {{subject.bone: like_people, subject.random_seed: {seed}, '
                         f"sites: {{{further}}}}}}}")
    lines += [f"grid: {{interp: {SCHEMES}}}", "metric: depth_truth.along_direction.rms_mm", ""]
    (folder / "dense_phantoms.yaml").write_text("\n".join(lines))


main()
