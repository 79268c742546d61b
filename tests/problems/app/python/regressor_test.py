# SPDX-License-Identifier: GPL-3.0-or-later
"""Tests SurfaceRegressor against a known surface, and with scikit-learn's own checks where it is installed."""
import pickle
import unittest

import numpy as np
import semblance


def table(count, seed):
    random = np.random.default_rng(seed)
    places = random.uniform(-40, 40, (count, 2))
    heights = 8 * np.sin(places[:, 0] / 9) * np.cos(places[:, 1] / 13)
    return places, heights, heights + random.normal(0, 0.2, count)


class Regressor(unittest.TestCase):
    def test_heights_and_their_deviation_are_those_of_the_surface(self):
        places, _, noisy = table(5000, 1)
        new, truth, observed = table(2000, 2)
        inside = (np.abs(new) < 38).all(axis=1)
        new, truth, observed = new[inside], truth[inside], observed[inside]
        regressor = semblance.SurfaceRegressor(level=0.9).fit(places, noisy)
        height, sd = regressor.predict(new, return_std=True)
        error = np.sqrt(np.mean((height - truth) ** 2))
        self.assertLess(error, 0.1)
        self.assertTrue(0.5 < error / np.sqrt(np.mean(sd**2)) < 2, (error, sd.mean()))
        low, high = regressor.predict_interval(new)
        self.assertTrue(0.86 < np.mean((low < observed) & (observed < high)) < 0.94)
        self.assertGreater(regressor.score(new, truth), 0.99)
        again = pickle.loads(pickle.dumps(regressor))
        np.testing.assert_array_equal(again.predict(new), height)

    def test_weight_zero_is_the_same_as_a_missing_row(self):
        places, _, noisy = table(400, 3)
        weight = np.r_[np.ones(300), np.zeros(100)]
        noisy[300:] += 50
        one = semblance.SurfaceRegressor().fit(places, noisy, sample_weight=weight).predict(places)
        two = semblance.SurfaceRegressor().fit(places[:300], noisy[:300], sample_weight=np.ones(300)).predict(places)
        np.testing.assert_allclose(one, two, atol=1e-9)

    def test_intervals_of_points_with_known_deviations_hold_their_share(self):
        random = np.random.default_rng(8)
        places, truth, _ = table(6000, 7)
        deviation = np.where(places[:, 0] < 0, 0.02, 0.2)
        heights = truth + random.normal(0, deviation)
        regressor = semblance.SurfaceRegressor().fit(places[:4000], heights[:4000], sample_weight=deviation[:4000] ** -2)
        low, high = regressor.predict_interval(places[4000:])
        holds = (low < heights[4000:]) & (heights[4000:] < high)
        for half in (places[4000:, 0] < 0, places[4000:, 0] > 0):
            self.assertTrue(0.84 < holds[half].mean() < 0.96, holds[half].mean())

    def test_nothing_is_known_outside_the_points(self):
        places, _, noisy = table(400, 4)
        regressor = semblance.SurfaceRegressor().fit(places, noisy)
        outside = np.array([[60.0, 0.0], [0.0, -1e6]])
        height, sd = regressor.predict(outside, return_std=True)
        low, high = regressor.predict_interval(outside)
        self.assertTrue(np.isfinite(height).all() and np.isinf(sd).all())
        self.assertTrue(np.isneginf(low).all() and np.isposinf(high).all())
        self.assertTrue(np.isfinite(regressor.predict(places, return_std=True)[1]).all())

    def test_notes_of_the_fit_are_warnings(self):
        places, heights, _ = table(400, 5)
        random = np.random.default_rng(6)
        heights += np.where(random.random(400) < 0.3, random.normal(0, 300, 400), 0)
        with self.assertWarnsRegex(UserWarning, "long tail"):
            regressor = semblance.SurfaceRegressor().fit(places, heights)
        self.assertEqual(len(regressor.fit_.notes), 1)

    def test_parameters_are_those_of_the_constructor(self):
        regressor = semblance.SurfaceRegressor(level=0.5)
        self.assertEqual(regressor.get_params(), {"options": None, "level": 0.5, "threads": 1})
        self.assertEqual(regressor.set_params(level=0.8).level, 0.8)
        with self.assertRaises(ValueError):
            regressor.set_params(levle=0.8)

    def test_scikit_learn_accepts_the_estimator(self):
        try:
            from sklearn.utils.estimator_checks import check_estimator
        except ImportError:
            self.skipTest("scikit-learn is not installed (Debian: python3-sklearn)")
        check_estimator(semblance.SurfaceRegressor())


if __name__ == "__main__":
    import sys

    unittest.main(argv=sys.argv[:1])
