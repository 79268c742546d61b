# SPDX-License-Identifier: GPL-3.0-or-later
"""A map of the sea floor from soundings along tracks, with its uncertainty, by an estimator like scikit-learn's.

    PYTHONPATH=build/python python3 docs/examples/bathymetry.py
"""
import numpy as np
import semblance

random = np.random.default_rng(7)


def depth_m(places):
    """A shelf with a channel and a mound, in m."""
    x, y = places.T
    return -40 - 0.01 * x - 12 * np.exp(-(((y - 500 - 100 * np.sin(x / 300)) / 80) ** 2)) + 9 * np.exp(-((x - 600) ** 2 + (y - 200) ** 2) / 90**2)


# A ship sails to and fro, 40 m apart, and sounds each 5 m; one sounding in fifty hits a fish.
y, x = np.meshgrid(np.arange(0, 1001, 40.0), np.arange(0, 1001, 5.0))
places = np.column_stack([x.ravel(), y.ravel()]) + random.normal(0, 1.5, (x.size, 2))
soundings_m = depth_m(places) + random.normal(0, 0.3, x.size)
soundings_m[::50] += random.uniform(5, 20, soundings_m[::50].size)

new = random.uniform(50, 950, (2000, 2))
floor = semblance.SurfaceRegressor(level=0.9).fit(places, soundings_m)
height_m, sd_m = floor.predict(new, return_std=True)
low_m, high_m = floor.predict_interval(new)
observed_m = depth_m(new) + random.normal(0, 0.3, len(new))
within = np.mean((observed_m >= low_m) & (observed_m <= high_m))
error_m = np.sqrt(np.mean((height_m - depth_m(new)) ** 2))

print(floor.fit_)
print(f"noise {floor.fit_.noise_mm:.2f} m; RMS error of the map {error_m:.3f} m, stated {np.sqrt(np.mean(sd_m**2)):.3f} m")
print(f"{100 * within:.0f} % of new soundings lie within the 90 % interval; R^2 {floor.score(new, depth_m(new)):.4f}")
floor.fit_.surface.write("floor.glb")
assert error_m < 0.3 and 0.8 < within < 0.97 and len(floor.fit_.outliers) >= 90
