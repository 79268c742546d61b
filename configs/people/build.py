#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes depth.csv: how deep the tissue of 54 adults is all over the facial bone.

    python3 configs/people/build.py POPULATION > configs/people/depth.csv

POPULATION holds joint_model/, made from 54 head CTs of OpenKBP (NOTICE names source and licence):
the mean facial bone as points with normals, and of the logarithm of depth at each point the mean,
the standard deviation, the loading on build and the number of heads. The file has no single head.

1. Points that fewer than eight heads show are left out.
2. 0.3 mm are added to the mean depth: the voxels of about 4 mm make tissue 0.1 mm (sampled) to
   0.5 mm (averaged) too thin.
3. Loadings are kept within -0.95 and 0.95, since an estimated one may exceed 1.
4. Four pairs of sites are added where no published table has one: upper temple, temporal fossa, upper
   masseter and parotid region. Each is the point of the mean bone nearest to a place stated by the
   other sites. Its depth is the mean over the points within about 6 mm, on both sides of the head.
"""
import pathlib
import sys

import numpy as np

FEWEST_HEADS = 8
TOO_THIN_MM = 0.3
MOST_LOADING = 0.95
# The sites of the last rows, in their order.
SITES = ("sg g n rhi mp pr id sm pg me fe_l fe_r mso_l mso_r mio_l mio_r im_l im_r lo_l lo_r zy_l zy_r "
         "sgl_l sgl_r go_l go_r sM2_l sM2_r mr_l mr_r iM2_l iM2_r").split()
# mm around a site over which its depth is averaged: about the distance of neighbouring points.
WIDTH_MM = 6


def places(site):
    """Where the further sites of one side lie; site: code -> position of that side's sites."""
    return {"ut": site["lo"] + [0, 45, 45],  # x is that of the bone there
            "tf": site["lo"] + [0, 15, 42],
            "ma": (site["zy"] + site["mr"]) / 2 + [0, -5, 0],
            "pa": (site["sgl"] + site["go"]) / 2 + [0, -3, 0]}


def further(points, normals, sites, depths):
    """Rows (code, point, normal, depth) of the further sites. The depths of both sides are averaged."""
    found = {}
    for side, sign in (("l", 1), ("r", -1)):
        own = {code[:-2]: p for code, p in sites.items() if code.endswith("_" + side)}
        beside = np.where(sign * normals[:, 0] > 0.5)[0]
        for code, place in places(own).items():
            distance = np.linalg.norm((points[beside] - place)[:, 1:], axis=1)
            at = beside[np.argmin(distance)]
            weights = np.exp(-np.sum((points[beside] - points[at]) ** 2, axis=1) / (2 * WIDTH_MM ** 2))
            found[code, side] = at, weights @ depths[beside] / weights.sum()
    return [(f"{code}_{side}", points[at], normals[at], (found[code, "l"][1] + found[code, "r"][1]) / 2)
            for (code, side), (at, _) in sorted(found.items())]


def main():
    folder = pathlib.Path(sys.argv[1]) / "joint_model"
    points = np.load(folder / "bone_points_mm.npy")
    normals = np.load(folder / "bone_normals.npy")
    mean, sd, loading, heads = np.load(folder / "bone_log_depth.npy").T
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    between = len(points) - len(SITES)
    print("site,x_mm,y_mm,z_mm,normal_x,normal_y,normal_z,log_mean,log_sd,loading")
    used = np.where((heads >= FEWEST_HEADS) & np.isfinite(mean) & (sd > 0))[0]
    depths = np.stack([np.log(np.exp(mean) + TOO_THIN_MM), sd, np.clip(loading, -MOST_LOADING, MOST_LOADING)], axis=1)
    sites = {SITES[i - between]: points[i] for i in used if i >= between}
    rows = [("" if i < between else SITES[i - between], points[i], normals[i], depths[i]) for i in used]
    for site, point, normal, depth in rows + further(points[used], normals[used], sites, depths[used]):
        print(site, *("%.2f" % x for x in point), *("%.4f" % x for x in normal), *("%.4f" % x for x in depth), sep=",")


if __name__ == "__main__":
    main()
