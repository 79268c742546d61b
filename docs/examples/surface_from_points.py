# SPDX-License-Identifier: GPL-3.0-or-later
"""An H-spline surface through scattered points with noise and outliers, and its height at a new place.

    PYTHONPATH=build/python python3 docs/examples/surface_from_points.py
"""
import numpy as np
import semblance

random = np.random.default_rng(1)
x, y = random.uniform(-40, 40, (2, 5000))
z = 8 * np.sin(x / 9) * np.cos(y / 13) + random.normal(0, 0.05, x.size)
z[:50] += 10  # one point in a hundred is an outlier

found = semblance.fit(np.column_stack([x, y, z]))  # smoothness, detail and outliers follow from the points
print(f"usable: {found.usable}, RMS {found.rms_mm:.3f}, outliers apart; (u,v) by {found.parameters}")
there = found.predict([[0, 0], [20, -30]])
print("heights", there["z"].round(2), "+-", there["sd"].round(3), "supported", there["supported"])
found.surface.write("surface.hspline.json")
vertices, triangles, _ = found.surface.mesh(per_patch=2)
print(f"surface.hspline.json; {len(vertices)} vertices and {len(triangles)} triangles as a mesh")
assert found.usable
