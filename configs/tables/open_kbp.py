#!/usr/bin/env python3
"""Makes configs/tables/open_kbp.yaml from the depths of 54 heads: site_depths_open_kbp.csv of the population (OpenKBP, MIT licence).

    open_kbp.py SITE_DEPTHS.csv > configs/tables/open_kbp.yaml
    open_kbp.py SITE_DEPTHS.csv --check OTHER_DEPTHS.csv     # how well it predicts each head without it, and heads of another source
    open_kbp.py SITE_DEPTHS.csv --scatter configs/tables/t_table_2023.yaml     # depth_scatter (docs/explanation/plausibility.md) of the heads

Build is a person's mean deviation from the means of log depth, in standard deviations of the sites. Depths are means, deviations and
correlations of mm, as the table's format has them; values that lie beyond 3 robust deviations of log depth at their site (a ray that
left through the open mouth, a bite block) are left out.
"""
import csv
import re
import sys

import numpy as np

SITES = ["sg", "g", "n", "rhi", "mp", "pr", "id", "sm", "pg", "me", "fe", "mso", "mio", "im", "lo", "zy", "sgl", "go", "sM2", "mr", "iM2"]
# Voxels of 3.9 x 3.9 x 2.5 mm make two fine CTs 0.1 mm (sampled) to 0.6 mm (averaged) too thin.
COARSE_MM = 0.3
KEPT = 0.5  # of the sample's correlations that build does not explain; the rest is zero


def read(path):
    with open(path) as file:
        rows = list(csv.DictReader(file))
    columns = [key for key in rows[0] if key.split("_")[0].isdigit()]
    names = ["_".join([SITES[int(key.split("_")[0]) - 1], *key.split("_")[1:]]) for key in columns]
    return names, np.array([[float(row[key] or "nan") for key in columns] for row in rows])


def without_outliers(depths, names):
    depths = depths.copy()
    for site in SITES:
        own = [k for k, name in enumerate(names) if name.split("_")[0] == site]
        logs = np.log(depths[:, own])
        middle = np.nanmedian(logs)
        spread = 1.4826 * np.nanmedian(np.abs(logs - middle))
        off = np.abs(logs - middle) > 3 * max(spread, 0.15)
        depths[:, own] = np.where(off, np.nan, depths[:, own])
    return depths


def standardised(depths, names, mean, sd):
    return (depths - np.array([mean[n.split("_")[0]] for n in names])) / np.array([sd[n.split("_")[0]] for n in names])


def describe(depths, names):
    """Means, deviations and counts by site, and correlations of all names and build."""
    depths = without_outliers(depths, names) + COARSE_MM
    mean, sd, count = {}, {}, {}
    for site in SITES:
        own = [k for k, name in enumerate(names) if name.split("_")[0] == site]
        values = depths[:, own]
        mean[site], sd[site] = np.nanmean(values), np.nanstd(values, ddof=1)
        count[site] = int((~np.isnan(values)).any(axis=1).sum())
    z = standardised(depths, names, mean, sd)
    build = np.nanmean(z, axis=1)
    build_sd = build.std(ddof=1)
    b = build / build_sd
    loading = np.array([np.nansum(z[:, k] * b) / np.nansum(b[~np.isnan(z[:, k])] ** 2) for k in range(len(names))])
    loading = np.clip(loading, 0.05, 0.95)
    for site in SITES:  # the sides share what they have in common
        own = [k for k, name in enumerate(names) if name.split("_")[0] == site]
        loading[own] = loading[own].mean()
    rest = z - np.outer(b, loading)
    left = np.eye(len(names))
    for i in range(len(names)):
        for j in range(i):
            both = ~np.isnan(rest[:, i]) & ~np.isnan(rest[:, j])
            r = np.corrcoef(rest[both, i], rest[both, j])[0, 1] if both.sum() > 8 else 0
            left[i, j] = left[j, i] = KEPT * r
    own = np.sqrt(1 - loading ** 2)
    correlation = np.eye(len(names) + 1)
    correlation[:-1, :-1] = np.outer(loading, loading) + left * np.outer(own, own)
    np.fill_diagonal(correlation, 1)
    correlation[-1, :-1] = correlation[:-1, -1] = loading
    values, vectors = np.linalg.eigh(correlation)
    correlation = vectors @ np.diag(np.maximum(values, 0.02)) @ vectors.T
    scale = np.sqrt(np.diag(correlation))
    return mean, sd, count, correlation / np.outer(scale, scale), build_sd


def predict(table, names, known, build):
    """Conditional mean and sd by name, given depths (by index) and build (or None)."""
    mean, sd, _, correlation, _ = table
    m = np.array([mean[n.split("_")[0]] for n in names] + [0.0])
    s = np.array([sd[n.split("_")[0]] for n in names] + [1.0])
    cov = correlation * np.outer(s, s)
    given = list(known)
    values = [known[k] for k in given]
    if build is not None:
        given.append(len(names))
        values.append(build)
    if not given:
        return m[:-1], s[:-1]
    gain = cov[:, given] @ np.linalg.inv(cov[np.ix_(given, given)])
    after = m + gain @ (np.array(values) - m[given])
    left = np.diag(cov) - np.einsum("ij,ji->i", gain, cov[given, :])
    return after[:-1], np.sqrt(np.maximum(left[:-1], 1e-6))


def check(names, depths, other_names, other):
    def score(rows):
        error = np.concatenate([r[0] for r in rows])
        inside = np.concatenate([r[1] for r in rows])
        return f"RMS {np.sqrt(np.mean(error ** 2)):.2f} mm, mean {np.mean(error):+.2f} mm, 90 % intervals hold {100 * np.mean(inside):.0f} %"

    def all_ways(pairs):
        for what, sites, with_build in [("build unknown", [], False), ("build stated", [], True), ("build stated to half an sd", [], 0.5),
                                        ("one depth known (zy)", ["zy_l"], False), ("five depths known", ["g", "pg", "zy_l", "go_l", "mr_l"], False)]:
            rows = []
            for table, cols, head in pairs:
                clean = without_outliers_by(table, cols, head)
                z = standardised(clean[None, :], cols, table[0], table[1])
                b = float(np.nanmean(z)) / table[4]
                known = {cols.index(s): head[cols.index(s)] for s in sites if s in cols and not np.isnan(clean[cols.index(s)])}
                stated = None if with_build is False else b if with_build is True else 0.5 * round(b / 0.5)
                mean, sd = predict(table, cols, known, stated)
                off = clean - mean
                ok = ~np.isnan(off)
                ok[list(known)] = False
                rows.append((off[ok], np.abs(off[ok]) < 1.645 * sd[ok]))
            print(f"  {what}: {score(rows)}")

    print(f"{len(depths)} heads, each without itself:")
    all_ways([(describe(np.delete(depths, k, axis=0), names), names, depths[k] + COARSE_MM) for k in range(len(depths))])
    table = describe(depths, names)
    print(f"{len(other)} heads of another source:")
    shared = [other_names.index(n) for n in names]
    all_ways([(table, names, head[shared]) for head in other])


def without_outliers_by(table, names, head):
    mean, sd = table[0], table[1]
    z = np.log(head / np.array([mean[n.split("_")[0]] for n in names]))
    limit = np.array([3.5 * max(sd[n.split("_")[0]] / mean[n.split("_")[0]], 0.15) for n in names])
    return np.where(np.abs(z) > limit, np.nan, head)


def scatter(names, depths, table):
    """Scatter and level of the heads' depths over a table's means, as factors: the least, the median and the largest."""
    text = open(table).read()
    means = {site: float(mean) for site, mean in re.findall(r'site: "?(\w+)"?\n.*\n.*\n +adult: \{mean: ([\d.]+)', text)}
    own = [k for k, name in enumerate(names) if name.split("_")[0] in means]
    logs = np.log(depths[:, own] / np.array([means[names[k].split("_")[0]] for k in own]))
    logs = logs[(~np.isnan(logs)).sum(axis=1) >= 10]
    off = np.minimum(np.abs(logs - np.nanmedian(logs, axis=1, keepdims=True)), 1.3)  # one wrong depth counts as 3.7 times
    factors = np.exp(np.sqrt(np.nanmean(off**2, axis=1)))
    for name, values in (("scatter", factors), ("level", np.exp(np.nanmedian(logs, axis=1)))):
        print(f"{name} of {len(values)} heads: {values.min():.2f}, median {np.median(values):.2f}, {values.max():.2f}")


def main():
    names, depths = read(sys.argv[1])
    if "--scatter" in sys.argv:
        scatter(names, depths, sys.argv[sys.argv.index("--scatter") + 1])
        return
    if "--check" in sys.argv:
        check(names, depths, *read(sys.argv[sys.argv.index("--check") + 1]))
        return
    mean, sd, count, correlation, build_sd = describe(depths, names)
    print("# SPDX-License-Identifier: MIT")
    print(HEAD)
    for site in SITES:
        print(f"  - site: {quoted(site)}\n    values:\n      adult: {{mean: {mean[site]:.2f}, sd: {sd[site]:.2f}, n: {count[site]}}}")
    all_names = names + ["build"]
    print(f"correlations:\n  subjects: {len(depths)}\n  covariates: [{{name: build, mean: 0, sd: 1}}]")
    print(f"  names: [{', '.join(map(quoted, all_names))}]\n  rows:")
    for k in range(len(all_names)):
        print(f"    - [{', '.join(f'{c:.3f}' for c in correlation[k, :k])}]")


def quoted(name):
    return '"n"' if name == "n" else name


HEAD = """# Tissue depths of 54 supine living adults under radiotherapy, mostly men over 50, measured on coarse CTs (docs/how-to/populations.md).
# Made by configs/tables/open_kbp.py. `given: {build: emaciated | obese}` or `build_sds` moves each depth by its own loading.
id: open_kbp
title: "OpenKBP"
citation: "measured on the CTs of A. Babier et al. (2021), OpenKBP, Medical Physics 48, 5549-5561 (MIT licence)"
population_label: "adults under radiotherapy, mostly men over 50, pooled"
units: mm
measurement: {method: ct, convention: along_bone_normal, posture: supine}
rows:"""

main()
