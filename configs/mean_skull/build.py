#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Builds the mean skull and its modes from a folder of coarse head CTs.

    python3 configs/mean_skull/build.py POPULATION configs/mean_skull

POPULATION holds heads_open_kbp/*.nrrd and joint_model/bone_points_mm.npy (README.md beside this
file names the source). The script needs python3-numpy and python3-scipy, and about 10 minutes on
two cores. It writes mean.off and modes.csv, and nothing of a single head.

1. Pose: trimmed ICP lays the joint model's mean facial bone on the bone of each head.
2. Mean and warps, in rounds: the heads are averaged as they are warped at present; the average is
   made symmetric; each head is warped onto it again by demons (Thirion 1998) with smooth
   displacements.
3. Surface: the half-maximum surface of the mean's bone, seen from outside, in about 4,000 vertices.
4. Modes: principal components of the displacements of these vertices, without pose and size, over
   all heads and their mirror images.
"""
import glob
import gzip
import multiprocessing
import sys

import numpy as np
from scipy import ndimage, sparse
from scipy.sparse import csgraph  # noqa: F401 (loads sparse.csgraph)
from scipy.spatial import cKDTree

CELL = 4.0  # mm, grid of the warps
LOW = np.array([-88.0, -36.0, -136.0])  # mm, first corner; x is symmetric
SIZE = (45, 46, 57)  # x, y, z
BONE = 226.0  # HU, of one head
# HU, of the mean, where thin bone is blurred; with 226, the front of the maxilla has holes.
MEAN_BONE = 160.0
# Standard deviations in mm of the smoothing of the displacements, and how many iterations each has.
STAGES = ((30.0, 10), (18.0, 12), (12.0, 16))
ROUNDS = 2
MODES = 12

# Site of each of the last 32 points of the joint model, and its place on the average skull
# (problems/subject/average_skull.cc).
AVERAGE = [(0, 3, 27), (0, -2, 13), (0, 0, 0), (0, -11, -14), (0, 0, -62), (0, -1, -67),
           (0, 4, -91), (0, 10, -102), (0, 10, -112), (0, 19, -121)]
for left in [(31, 20, 44), (29, 6, 11), (35, 12, -29), (41, 20, -41), (46, 21, -36),
             (63, 57, -29), (60, 81, -27), (48, 71, -89), (29, 35, -61), (45, 61, -71),
             (34, 38, -89)]:
    AVERAGE += [left, (-left[0],) + left[1:]]


def read_nrrd(path):
    """Returns HU (x, y, z), the voxel sizes and the first voxel's centre in mm."""
    head, body = open(path, 'rb').read().split(b'\n\n', 1)
    fields = dict(line.split(': ', 1) for line in head.decode().split('\n') if ': ' in line)
    sizes = [int(n) for n in fields['sizes'].split()]
    steps = np.diag([[float(c) for c in d.strip('()').split(',')]
                     for d in fields['space directions'].split()])
    origin = np.array([float(c) for c in fields['space origin'].strip('()').split(',')])
    voxels = np.frombuffer(gzip.decompress(body), '<i2').reshape(sizes[::-1])
    return voxels.transpose(2, 1, 0).astype(np.float32), steps, origin


def similarity(source, target, weights=None):
    """Umeyama (1991): the matrix A and the shift b that minimise |A source + b - target|."""
    w = np.ones(len(source)) if weights is None else weights
    w = w / w.sum()
    ms, mt = w @ source, w @ target
    s, t = source - ms, target - mt
    u, d, vt = np.linalg.svd((t * w[:, None]).T @ s)
    sign = np.array([1, 1, np.sign(np.linalg.det(u @ vt))])
    a = (u * sign) @ vt * ((d * sign).sum() / (w @ (s * s).sum(1)))
    return a, mt - a @ ms


def bone_surface(hu, steps, origin):
    """Points where bone meets what is not bone, to a voxel's fraction along each axis."""
    points = []
    for axis in range(3):
        a = np.moveaxis(hu, axis, 0)
        crossing = (a[:-1] > BONE) != (a[1:] > BONE)
        at = np.argwhere(crossing)
        v0, v1 = a[:-1][crossing], a[1:][crossing]
        index = at.astype(float)
        index[:, 0] += (BONE - v0) / (v1 - v0)
        index[:, [0, axis]] = index[:, [axis, 0]] if axis == 1 else index[:, [0, axis]]
        if axis == 2:  # moveaxis gave (z, x, y)
            index = index[:, [1, 2, 0]]
        points.append(origin + index * steps)
    return np.concatenate(points)


def icp(template, bone, tree, a, b, rounds):
    for _ in range(rounds):
        d, k = tree.query(template @ a.T + b)
        keep = d <= np.quantile(d, 0.8)
        a, b = similarity(template[keep], bone[k[keep]])
        size = np.cbrt(np.linalg.det(a))
        a *= np.clip(size, 0.85, 1.15) / size
        b = bone[k[keep]].mean(0) - a @ template[keep].mean(0)
    d = np.sort(tree.query(template @ a.T + b)[0])
    return d[:int(0.8 * len(d))].mean(), a, b


def find_pose(template, bone):
    """The best of several trimmed ICPs: the head's frame from the template's."""
    tree = cKDTree(bone)
    middle = (np.percentile(bone, 2, axis=0) + np.percentile(bone, 98, axis=0)) / 2
    front = np.percentile(bone[:, 1], 1)
    best = (np.inf,)
    for up in range(-60, 61, 20):
        for back in (0, 20):
            start = np.array([middle[0] - template[:, 0].mean(),
                              front + back - template[:, 1].min(),
                              middle[2] + up - template[:, 2].mean()])
            best = min(best, icp(template[::5], bone, tree, np.eye(3), start, 20), key=lambda c: c[0])
    return icp(template, bone, tree, *best[1:], 30)


def grid_points():
    axes = [LOW[i] + CELL * np.arange(SIZE[i]) for i in range(3)]
    return np.stack(np.meshgrid(*axes, indexing='ij')).astype(np.float32)


def smooth(values, width):
    """Two box filters with the variance of a Gaussian of the standard deviation `width` (mm)."""
    size = int(round(np.sqrt(6 * (width / CELL) ** 2 + 1)))
    return ndimage.uniform_filter(ndimage.uniform_filter(values, size), size)


def contrast(hu):
    """Tissue against air, and bone against tissue: both edges guide the warp."""
    return (0.3 * np.clip((hu + 700) / 700, 0, 1) + np.clip((hu - 50) / 500, 0, 1)).astype(np.float32)


class Head:
    def __init__(self, hu, steps, origin, a, b):
        # The matrix and shift from the mean's frame (mm) to voxels.
        self.a = (a / steps[:, None]).astype(np.float32)
        self.b = ((b - origin) / steps).astype(np.float32)
        self.hu = hu
        self.image = contrast(hu)
        self.warp = np.zeros((3,) + SIZE, np.float32)

    def sample(self, image, places, outside):
        voxels = np.tensordot(self.a, places, 1) + self.b[:, None, None, None]
        return ndimage.map_coordinates(image, voxels, order=1, cval=outside, mode='constant')

    def inside(self, places):
        voxels = np.tensordot(self.a, places, 1) + self.b[:, None, None, None]
        return np.all([(voxels[i] >= 0) & (voxels[i] <= self.image.shape[i] - 1) for i in range(3)], 0)

    def demons(self, mean, known, grid):
        for width, iterations in STAGES:
            for _ in range(iterations):
                places = grid + self.warp
                moved = self.sample(self.image, places, 0)
                seen = self.inside(places) & known
                slope = np.stack(np.gradient(moved, CELL)) / 2 + np.stack(np.gradient(mean, CELL)) / 2
                error = np.where(seen, mean - moved, 0)
                step = slope * (error / ((slope ** 2).sum(0) + (error / (2 * CELL)) ** 2 + 1e-6))
                # A wide kernel would dilute a force that acts at edges only, so it is normalised by
                # how much edge there is.
                weight = (slope ** 2).sum(0) * seen
                near = smooth(weight, width) + 1e-7
                for i in range(3):
                    self.warp[i] += smooth(step[i] * weight, width) / near
            for i in range(3):
                self.warp[i] = ndimage.gaussian_filter(self.warp[i], 0.5)
        return self.warp


def average(heads, grid):
    total, count = np.zeros(SIZE, np.float32), np.zeros(SIZE, np.float32)
    for h in heads:
        places = grid + h.warp
        seen = h.inside(places)
        total += np.where(seen, h.sample(h.hu, places, 0), 0)
        count += seen
    total, count = total + total[::-1], count + count[::-1]
    return np.where(count > 0, total / np.maximum(count, 1), -1000), count / 2


# The sides of a cube's surface net: the four cells around an edge of the grid along each axis.
AROUND = {0: ((0, 0, 0), (0, -1, 0), (0, -1, -1), (0, 0, -1)),
          1: ((0, 0, 0), (0, 0, -1), (-1, 0, -1), (-1, 0, 0)),
          2: ((0, 0, 0), (-1, 0, 0), (-1, -1, 0), (0, -1, 0))}


def surface_net(values, level):
    """Surface nets (Gibson 1998): vertices in voxels, and triangles that face lower values."""
    inside = values > level
    sums = np.zeros(tuple(n - 1 for n in values.shape) + (3,))
    counts = np.zeros(sums.shape[:3])
    quads = []
    for axis in range(3):
        low = [slice(None)] * 3
        high = [slice(None)] * 3
        low[axis], high[axis] = slice(None, -1), slice(1, None)
        crossing = inside[tuple(low)] != inside[tuple(high)]
        at = np.argwhere(crossing)
        keep = np.all([(at[:, i] > 0) & (at[:, i] < values.shape[i] - 1) for i in range(3) if i != axis], 0)
        at = at[keep]
        v0 = values[tuple(at.T)]
        step = np.eye(3, dtype=int)[axis]
        v1 = values[tuple((at + step).T)]
        point = at + step * ((level - v0) / (v1 - v0))[:, None]
        cells = [at + np.array(o) for o in AROUND[axis]]
        for c in cells:
            np.add.at(sums, tuple(c.T), point)
            np.add.at(counts, tuple(c.T), 1)
        cells = np.array(cells)
        cells[:, v0 < level] = cells[::-1, v0 < level]
        quads.append(cells.transpose(1, 0, 2))
    used = np.argwhere(counts > 0)
    number = np.full(counts.shape, -1)
    number[tuple(used.T)] = np.arange(len(used))
    points = sums[tuple(used.T)] / counts[tuple(used.T)][:, None]
    quads = np.concatenate(quads)
    corners = number[tuple(quads.transpose(2, 0, 1))]
    return points, np.concatenate([corners[:, [0, 1, 2]], corners[:, [0, 2, 3]]])


def seen_from_outside(points, normals, solid):
    """True where a straight line along the normal, or 60 degrees from it, meets no further bone."""
    side = np.cross(normals, np.eye(3)[np.abs(normals).argmin(1)])
    side /= np.linalg.norm(side, axis=1)[:, None] + 1e-12
    other = np.cross(normals, side)
    seen = np.zeros(len(points), bool)
    for k in range(9):
        turn = 2 * np.pi * k / 8
        way = normals if k == 8 else (0.5 * normals + np.sqrt(0.75) *
                                      (np.cos(turn) * side + np.sin(turn) * other))
        free = np.ones(len(points), bool)
        for far in np.arange(1.5, 45):
            free &= ndimage.map_coordinates(solid, (points + far * way).T, order=0, cval=0) == 0
        seen |= free
    return seen


def components(count, triangles):
    edges = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]]])
    graph = sparse.coo_matrix((np.ones(len(edges)), edges.T), (count, count))
    return sparse.csgraph.connected_components(graph, directed=False)[1]


def outer_surface(hu):
    points, triangles = surface_net(hu, MEAN_BONE)
    normals = np.zeros_like(points)
    area = np.cross(points[triangles[:, 1]] - points[triangles[:, 0]],
                    points[triangles[:, 2]] - points[triangles[:, 0]])
    for i in range(3):
        np.add.at(normals, triangles[:, i], area)
    normals /= np.linalg.norm(normals, axis=1)[:, None] + 1e-12
    seen = seen_from_outside(points, normals, (hu > MEAN_BONE).astype(np.uint8))
    places = LOW + CELL * points
    neck = (places[:, 1] > 85) & (places[:, 2] < -42)  # vertebrae
    triangles = triangles[(seen & ~neck)[triangles].sum(1) >= 2]
    body = components(len(points), triangles)[triangles[:, 0]]
    size = np.bincount(body)
    triangles = triangles[size[body] >= 400]  # a smaller piece is a vertebra's tip or noise
    used, corners = np.unique(triangles, return_inverse=True)
    return points[used], corners.reshape(triangles.shape)


def finest_average(heads):
    """The average, made on a grid of 2 mm, because many coarse heads at different offsets hold more
    detail than one of them, and given at each second point."""
    fine = 2.0
    size = tuple(int((n - 1) * CELL / fine) + 1 for n in SIZE)
    index = np.stack(np.meshgrid(*[np.arange(n) * fine / CELL for n in size], indexing='ij'))
    places = (LOW[:, None, None, None] + CELL * index).astype(np.float32)
    total, count = np.zeros(size, np.float32), np.zeros(size, np.float32)
    for h in heads:
        warp = np.stack([ndimage.map_coordinates(w, index, order=1) for w in h.warp])
        seen = h.inside(places + warp)
        total += np.where(seen, h.sample(h.hu, places + warp, 0), 0)
        count += seen
    total, count = total + total[::-1], (count + count[::-1]) / 2
    return np.where(count >= 6, total / np.maximum(2 * count, 1), -1000)[::2, ::2, ::2]


def modes_of(points, heads):
    """Returns principal components of the vertices over heads and mirror images, scaled to deviation 1."""
    voxels = ((points - LOW) / CELL).T
    flip = np.array([-1, 1, 1])
    mirrored = (points * flip - LOW).T / CELL
    rows = []
    for h in heads:
        for at, sign in ((voxels, 1), (mirrored, flip)):
            moved = np.stack([ndimage.map_coordinates(w, at, order=1) for w in h.warp], 1) * sign
            a, b = similarity(points + moved, points)  # without pose and size
            rows.append(((points + moved) @ a.T + b - points).ravel())
    rows = np.array(rows)
    rows -= rows.mean(0)
    _, d, vt = np.linalg.svd(rows, full_matrices=False)
    share = np.cumsum(d ** 2) / (d ** 2).sum()
    print(f'{MODES} modes hold {100 * share[MODES - 1]:.0f} % of the variance; RMS of the first: '
          f'{d[0] / np.sqrt(len(rows) * len(points)):.2f} mm')
    return vt[:MODES] * (d[:MODES] / np.sqrt(len(rows) - 1))[:, None]


def write(out, points, triangles, modes):
    with open(out + '/mean.off', 'w') as f:
        f.write(f'OFF\n# mean of the heads of OpenKBP, mm, LPS; see README.md\n{len(points)} {len(triangles)} 0\n')
        for p in points:
            f.write('{:.2f} {:.2f} {:.2f}\n'.format(*p))
        for t in triangles:
            f.write('3 {} {} {}\n'.format(*t))
    with open(out + '/modes.csv', 'w') as f:
        f.write(','.join(f'{c}{k}' for k in range(1, MODES + 1) for c in 'xyz') + '\n')
        table = np.rint(10 * modes.reshape(MODES, -1, 3)).astype(int).transpose(1, 0, 2)
        for row in table:
            f.write(','.join(map(str, row.ravel())) + '\n')


def finish(heads, out):
    points, triangles = outer_surface(finest_average(heads))
    points = LOW + CELL * points
    write(out, points, triangles, modes_of(points, heads))
    print(f'{len(points)} vertices, {len(triangles)} triangles')


def main(population, out):
    bone = np.load(population + '/joint_model/bone_points_mm.npy').astype(float)
    a, b = similarity(bone[1239:], np.array(AVERAGE, float))
    template = bone @ a.T + b
    grid, heads = grid_points(), []
    for path in sorted(glob.glob(population + '/heads_open_kbp/*.nrrd')):
        hu, steps, origin = read_nrrd(path)
        misfit, a, b = find_pose(template, bone_surface(hu, steps, origin))
        print(f'{path[-10:-5]}: pose fits within {misfit:.2f} mm, size {np.cbrt(np.linalg.det(a)):.3f}',
              flush=True)
        if misfit < 3:  # one that is not recognised would only blur the mean
            heads.append(Head(hu, steps, origin, a, b))
    for round_ in range(ROUNDS):
        hu, count = average(heads, grid)
        mean, known = contrast(hu), count >= 6
        with multiprocessing.Pool(2) as pool:
            jobs = [(h, mean, known, grid) for h in heads]
            for h, warp in zip(heads, pool.starmap(Head.demons, jobs)):
                h.warp = warp
        shift = np.mean([h.warp for h in heads], 0)
        shift = (shift + shift[:, ::-1] * np.array([-1, 1, 1])[:, None, None, None]) / 2
        print(f'round {round_ + 1}: mean displacement {np.sqrt((shift ** 2).sum(0)).mean():.2f} mm',
              flush=True)
        for h in heads:  # the mean head has no displacement
            h.warp -= shift
    finish(heads, out)


def align(folder):
    """Turns and scales all three files so that the sites lie on those of the average skull."""
    lines = [r.split(',') for r in open(folder + '/sites.csv').read().split()[1:]]
    sites = np.array([[float(c) for c in r[1:4]] for r in lines])
    a, b = similarity(sites, np.array(AVERAGE, float))
    off = [r for r in open(folder + '/mean.off') if r[0] not in '#O']
    n = int(off[0].split()[0])
    points = np.array([r.split() for r in off[1:n + 1]], float) @ a.T + b
    triangles = np.array([r.split()[1:] for r in off[n + 1:]], int)
    modes = np.genfromtxt(folder + '/modes.csv', delimiter=',', skip_header=1) / 10
    modes = (modes.reshape(n, MODES, 3) @ a.T).transpose(1, 0, 2).reshape(MODES, -1)
    write(folder, points, triangles, modes)
    with open(folder + '/sites.csv', 'w') as f:
        f.write('site,x,y,z,error_mm\n')
        for r, p in zip(lines, sites @ a.T + b):
            f.write('{},{:.2f},{:.2f},{:.2f},{}\n'.format(r[0], *(p + 0.0), r[4]))


if __name__ == '__main__':
    if sys.argv[1] == '--align':
        align(sys.argv[2])
    else:
        main(sys.argv[1], sys.argv[2])
