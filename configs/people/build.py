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


def main():
    folder = pathlib.Path(sys.argv[1]) / "joint_model"
    points = np.load(folder / "bone_points_mm.npy")
    normals = np.load(folder / "bone_normals.npy")
    mean, sd, loading, heads = np.load(folder / "bone_log_depth.npy").T
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    between = len(points) - len(SITES)
    print("site,x_mm,y_mm,z_mm,normal_x,normal_y,normal_z,log_mean,log_sd,loading")
    for i in np.where((heads >= FEWEST_HEADS) & np.isfinite(mean) & (sd > 0))[0]:
        site = "" if i < between else SITES[i - between]
        deeper = np.log(np.exp(mean[i]) + TOO_THIN_MM)
        bounded = np.clip(loading[i], -MOST_LOADING, MOST_LOADING)
        print(site, *("%.2f" % x for x in points[i]), *("%.4f" % x for x in normals[i]),
              "%.4f" % deeper, "%.4f" % sd[i], "%.4f" % bounded, sep=",")


if __name__ == "__main__":
    main()
