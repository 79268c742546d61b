#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes made-up height fields of many kinds for `fit_bench files FOLDER`: NAME.csv.gz holds points
(x, y, z over the unit square), NAME.truth.npz the true heights on a grid of 200 x 200.

    kinds_of_points.py FOLDER [--seed 11] [--counts 10000,100000] [--only fault,contours]

Every kind has a smooth surface of its own, drawn from the seed, with heights of about 0.1 and
noise of 2e-3 unless the kind says something else. Needs numpy and scipy.
"""

import argparse
import gzip
import pathlib
import zlib

import numpy as np
from scipy.ndimage import gaussian_filter, map_coordinates

NOISE = 2e-3
CORRELATED_NOISE, CORRELATION_LENGTH = 5e-3, 0.02
STEP = 0.12
DRIFT = 1e-2


def smooth_surface(rng):
    """A function of (x, y): hills and waves whose standard deviation is about 0.1."""
    hills = [(rng.uniform(-0.1, 1.1, 2), rng.uniform(0.08, 0.35), rng.normal()) for _ in range(9)]
    waves = [(rng.normal(0, 5, 2), rng.uniform(0, 6.3), rng.normal(0, 0.3)) for _ in range(4)]

    def raw(x, y):
        z = sum(h * np.exp(-((x - c[0]) ** 2 + (y - c[1]) ** 2) / (2 * w * w)) for c, w, h in hills)
        return z + sum(a * np.sin(k[0] * x + k[1] * y + p) for k, p, a in waves)

    grid = np.linspace(0, 1, 64)
    scale = 0.1 / raw(*np.meshgrid(grid, grid)).std()
    return lambda x, y: scale * raw(x, y)


def correlated_field(rng, length, size=1024):
    """A Gaussian field of unit variance with this length of correlation, as a function of (x, y)."""
    field = gaussian_filter(rng.normal(size=(size, size)), length * size / np.sqrt(2), mode="wrap")
    field /= field.std()
    return lambda x, y: map_coordinates(field, [y * (size - 1), x * (size - 1)], order=1)


def fractal_field(rng, exponent=0.8, size=2048):
    """A terrain of fractional Brownian motion as a function of (x, y)."""
    k = np.hypot(np.fft.fftfreq(size)[:, None], np.fft.rfftfreq(size)[None, :])
    k[0, 0] = np.inf
    spectrum = k ** -(exponent + 1) * np.exp(2j * np.pi * rng.random(k.shape))
    field = np.fft.irfft2(spectrum, s=(size, size))
    field *= 0.1 / field.std()
    # A part of the periodic field, so that opposite sides differ.
    return lambda x, y: map_coordinates(field, [y * size * 0.7, x * size * 0.7], order=1)


def scattered(rng, count):
    return rng.random(count), rng.random(count)


def scan_lines(rng, count):
    """Places along parallel lines, ten times as dense along a line as across, and each one's line."""
    lines = max(int(np.sqrt(count / 10)), 4)
    line = np.repeat(np.arange(lines), count // lines)
    along = np.tile(np.linspace(0, 1, count // lines), lines)
    return along, (line + 0.5) / lines + rng.normal(0, 0.05 / lines, len(line)), line


def with_noise(make):
    """A kind of scattered places whose heights are make(rng, x, y, truth) plus noise of NOISE."""

    def kind(rng, count, truth):
        x, y = scattered(rng, count)
        return x, y, make(rng, x, y, truth) + rng.normal(0, NOISE, len(x)), None

    return kind


def plain(rng, count, truth):
    x, y = scattered(rng, count)
    return x, y, truth(x, y) + rng.normal(0, NOISE, count), truth


def fault(rng, count, truth):
    angle = rng.uniform(0.3, 1.2)

    def stepped(x, y):
        return truth(x, y) + STEP * ((x - 0.5) * np.cos(angle) + (y - 0.5) * np.sin(angle) > 0.03)

    return plain(rng, count, stepped)


def whole_numbers(rng, count, truth):
    def tall(x, y):
        return 40 * truth(x, y)

    x, y = scattered(rng, count)
    return x, y, np.round(tall(x, y)), tall


def ridge(rng, count, truth):
    at, slope = rng.uniform(0.35, 0.65), rng.uniform(-0.4, 0.4)

    def ridged(x, y):
        off = (x - at - slope * (y - 0.5)) / np.hypot(1, slope)
        return 0.3 * truth(x, y) + 0.1 * np.exp(-0.5 * (off * 200) ** 2)

    return plain(rng, count, ridged)


def small_bump(rng, count, truth):
    c = rng.uniform(0.3, 0.7, 2)
    return plain(rng, count, lambda x, y: truth(x, y) + 0.1 * np.exp(
        -((x - c[0]) ** 2 + (y - c[1]) ** 2) / (2 * 0.02 ** 2)))


def narrow_peaks(rng, count, truth):
    places = (np.arange(5) + 0.5) / 5 + rng.uniform(-0.03, 0.03)

    def peaked(x, y):
        z = 0.3 * truth(x, y)
        for a in places:
            for b in places:
                z = z + 0.1 * np.exp(-((x - a) ** 2 + (y - b) ** 2) / (2 * 0.012 ** 2))
        return z

    return plain(rng, count, peaked)


def tiny(size):
    def kind(rng, count, truth):
        x, y = scattered(rng, size)
        return x, y, 3 * truth(x, y) + rng.normal(0, 0.02, size), lambda x, y: 3 * truth(x, y)

    return kind


def canopy(rng, count, truth):
    x, y = scattered(rng, count)
    z = truth(x, y) + rng.normal(0, NOISE, count)
    tree = (x > 0.5) & (rng.random(count) < 0.4)
    return x, y, z + tree * rng.uniform(0.02, 0.6, count), truth


def outliers(share, one_sided):
    def kind(rng, count, truth):
        x, y, z, _ = plain(rng, count, truth)
        bad = rng.random(count) < share
        off = rng.uniform(0.05, 1, count) * (1 if one_sided else rng.choice([-1, 1], count))
        return x, y, z + bad * off, truth

    return kind


def noise_as_large_as_signal(rng, count, truth):
    x, y = scattered(rng, count)
    return x, y, truth(x, y) + rng.normal(0, 0.1, count), truth


def correlated_noise(rng, count, truth):
    x, y = scattered(rng, count)
    error = correlated_field(rng, CORRELATION_LENGTH)(x, y)
    return x, y, truth(x, y) + CORRELATED_NOISE * error, truth


def noise_that_varies(rng, count, truth):
    x, y = scattered(rng, count)
    return x, y, truth(x, y) + rng.normal(0, 1, count) * NOISE * 10 ** (2 * x - 1), truth


def heavy_tails(rng, count, truth):
    x, y = scattered(rng, count)
    return x, y, truth(x, y) + NOISE * rng.standard_t(2, count), truth


def twins(rng, count, truth):
    x, y = scattered(rng, count // 2)
    z = truth(x, y) + rng.normal(0, NOISE, len(x))
    again = np.float32(np.c_[x, y, z]).astype(float)
    return np.r_[x, again[:, 0]], np.r_[y, again[:, 1]], np.r_[z, again[:, 2]], truth


def clusters(rng, count, truth):
    centres = rng.random((40, 2))
    places = centres[rng.integers(0, 40, count)] + rng.normal(0, 0.03, (count, 2))
    few = rng.random(count) < 0.1
    places[few] = rng.random((few.sum(), 2))
    x, y = np.clip(places, 0, 1).T
    return x, y, truth(x, y) + rng.normal(0, NOISE, count), truth


def straight_lines(rng, count, truth):
    x, y, _ = scan_lines(rng, count)
    return x, y, truth(x, y) + rng.normal(0, NOISE, len(x)), truth


def drifting_lines(rng, count, truth):
    x, y, line = scan_lines(rng, count)
    offset = rng.normal(0, DRIFT, line.max() + 1)
    return x, y, truth(x, y) + offset[line] + rng.normal(0, NOISE, len(x)), truth


def contours(rng, count, truth):
    """Places where a dense sample crosses one of 25 heights; z is that height."""
    heights = np.linspace(-0.3, 0.3, 25)
    found = []
    while sum(len(f) for f in found) < count:
        x, y = scattered(rng, 400_000)
        z = truth(x, y)
        nearest = heights[np.argmin(np.abs(z[:, None] - heights[None, :]), axis=1)]
        keep = np.abs(z - nearest) < 2e-4
        found.append(np.c_[x, y, nearest][keep])
    rows = np.concatenate(found)[:count]
    return rows[:, 0], rows[:, 1], rows[:, 2], truth


def band(rng, count, truth):
    """Points in a curved band alone; the grid of the truth is limited to it by NaN."""

    def inside(x, y):
        return np.abs(y - 0.5 - 0.3 * np.sin(5 * x)) < 0.12

    x, y = scattered(rng, 8 * count)
    keep = np.flatnonzero(inside(x, y))[:count]
    x, y = x[keep], y[keep]
    return x, y, truth(x, y) + rng.normal(0, NOISE, len(x)), lambda x, y: np.where(
        inside(x, y), truth(x, y), np.nan)


def terrain(rng, count, truth):
    field = fractal_field(rng)
    x, y = scattered(rng, count)
    return x, y, field(x, y), field


def ripples(rng, count, truth):
    k = rng.uniform(15, 20)
    return plain(rng, count, lambda x, y: truth(x, y) + 0.05 * np.sin(2 * np.pi * k * x + 3 * y))


KINDS = {
    "plain": plain, "fault": fault, "whole_numbers": whole_numbers, "ridge": ridge,
    "small_bump": small_bump, "narrow_peaks": narrow_peaks, "canopy": canopy,
    "outliers_5": outliers(0.05, False), "outliers_30": outliers(0.3, False),
    "one_sided_20": outliers(0.2, True), "signal_to_noise_1": noise_as_large_as_signal,
    "correlated_noise": correlated_noise, "noise_that_varies": noise_that_varies,
    "heavy_tails": heavy_tails, "twins": twins, "clusters": clusters, "lines": straight_lines,
    "drifting_lines": drifting_lines, "contours": contours, "band": band, "terrain": terrain,
    "ripples": ripples,
}
TINY = {"tiny_16": tiny(16), "tiny_30": tiny(30), "tiny_300": tiny(300)}


def write(folder, name, kind, seed, count):
    rng = np.random.default_rng([seed, count, zlib.crc32(name.encode())])
    x, y, z, truth = kind(rng, count, smooth_surface(rng))
    with gzip.open(folder / f"{name}.csv.gz", "wt", compresslevel=1) as out:
        out.write("x,y,z\n")
        np.savetxt(out, np.c_[x, y, z], fmt="%.9g", delimiter=",")
    side = (np.arange(200) + 0.5) / 200
    gx, gy = (a.ravel() for a in np.meshgrid(side, side))
    xyz = np.c_[gx, gy, truth(gx, gy)]
    np.savez(folder / f"{name}.truth.npz", xyz=xyz[np.isfinite(xyz[:, 2])])


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--seed", type=int, default=11)
    parser.add_argument("--counts", default="10000,100000")
    parser.add_argument("--only", default="")
    options = parser.parse_args()
    only = [name for name in options.only.split(",") if name]
    if unknown := set(only) - set(KINDS) - set(TINY):
        parser.error(f"unknown kinds: {', '.join(sorted(unknown))}")
    options.folder.mkdir(parents=True, exist_ok=True)
    for count in map(int, options.counts.split(",")):
        for name, kind in KINDS.items():
            if not only or name in only:
                write(options.folder, f"{name}_{count}", kind, options.seed, count)
    for name, kind in TINY.items():
        if not only or name in only:
            write(options.folder, name, kind, options.seed, 0)


if __name__ == "__main__":
    main()
