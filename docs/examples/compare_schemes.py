# SPDX-License-Identifier: GPL-3.0-or-later
"""A study in one YAML file: three interpolation schemes on three synthetic heads, ranked by their error.

    PYTHONPATH=build/python python3 docs/examples/compare_schemes.py
"""
import collections
import pathlib
import statistics

import semblance

CONFIGS = pathlib.Path(__file__).resolve().parents[2] / "configs"
STUDY = f"""
base: {CONFIGS}/phantom.yaml
job: depth
set: {{subject.rings: 24}}
grid: {{interp: [nearest, radial_basis, kriging], subject.random_seed: [1, 2, 3]}}
metric: depth_truth.along_direction.rms_mm
"""
pathlib.Path("schemes.yaml").write_text(STUDY)
table = semblance.study("schemes.yaml", out="schemes", wide=True)
errors_mm = collections.defaultdict(list)
for row in table if isinstance(table, list) else table.to_dict("records"):
    errors_mm[row["interp"]].append(row["depth_truth.along_direction.rms_mm"])
for scheme, values in sorted(errors_mm.items(), key=lambda item: statistics.mean(item[1])):
    print(f"{scheme:14s} {statistics.mean(values):.3f} mm over {len(values)} heads")
assert len(errors_mm) == 3
