# SPDX-License-Identifier: GPL-3.0-or-later
"""Tests the Python module against closed forms and against files that it reads back."""
import copy
import inspect
import os
import pickle
import signal
import sys
import tempfile
import threading
import time
import unittest

import numpy as np

import semblance

SOURCE = sys.argv.pop()


def paraboloid(side):
    x, y = np.meshgrid(np.linspace(-20, 20, side), np.linspace(-20, 20, side))
    return np.column_stack([x.ravel(), y.ravel(), 0.01 * (x**2 + y**2).ravel()])


def plane_net(rows=5, columns=6):
    net = np.zeros((rows, columns, 3))
    net[..., 0] = 10.0 * (np.arange(columns)[None, :] - 1)
    net[..., 1] = 10.0 * (np.arange(rows)[:, None] - 1)
    return net


def sphere(radius=50.0, rings=24):
    """Vertices and triangles of a closed sphere, oriented outwards."""
    points, triangles = [[0, 0, radius]], []
    for i in range(1, rings):
        for j in range(2 * rings):
            t, p = np.pi * i / rings, np.pi * j / rings
            points.append([radius * np.sin(t) * np.cos(p), radius * np.sin(t) * np.sin(p), radius * np.cos(t)])
    points.append([0, 0, -radius])
    n = 2 * rings
    at = lambda i, j: 1 + (i - 1) * n + j % n
    for j in range(n):
        triangles.append([0, at(1, j), at(1, j + 1)])
        triangles.append([len(points) - 1, at(rings - 1, j + 1), at(rings - 1, j)])
        for i in range(1, rings - 1):
            triangles += [[at(i, j), at(i + 1, j), at(i + 1, j + 1)], [at(i, j), at(i + 1, j + 1), at(i, j + 1)]]
    return np.array(points), np.array(triangles)


class Surface(unittest.TestCase):
    def test_a_flat_net_gives_a_plane(self):
        surface = semblance.HSpline(plane_net(), max_level=2)
        uv = np.random.default_rng(1).random((50, 2))
        points = surface.points(uv)
        np.testing.assert_allclose(points, np.column_stack([30 * uv[:, 0], 20 * uv[:, 1], 0 * uv[:, 0]]), atol=1e-12)
        np.testing.assert_allclose(surface.normals(uv), np.tile([0, 0, 1], (50, 1)), atol=1e-12)
        np.testing.assert_allclose(surface.derivatives(uv, 1, 0), np.tile([30, 0, 0], (50, 1)), atol=1e-10)
        np.testing.assert_allclose(surface.derivatives(uv, 0, 2), np.zeros((50, 3)), atol=1e-9)

    def test_projection_finds_the_closest_point(self):
        surface = semblance.HSpline(plane_net(), max_level=0)
        uv, distance = surface.project([[15.0, 5.0, -7.0]])
        np.testing.assert_allclose(uv, [[0.5, 0.25]], atol=1e-9)
        np.testing.assert_allclose(distance, [7.0], atol=1e-9)

    def test_a_changed_net_is_read_back_and_finer_detail_moves_with_it(self):
        surface = semblance.HSpline(plane_net(), max_level=1)
        fine = surface.net(1)
        fine[4, 4, 2] += 1.0
        surface.set_net(1, fine)
        np.testing.assert_allclose(surface.net(1), fine, atol=1e-12)
        coarse = surface.net(0)
        coarse[..., 2] += 5.0
        surface.set_net(0, coarse)
        np.testing.assert_allclose(surface.net(1)[..., 2], fine[..., 2] + 5.0, atol=1e-9)

    def test_a_file_gives_the_identical_surface(self):
        surface = semblance.HSpline(plane_net() + 0.1, max_level=1)
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "s.hspline.json")
            surface.write(path)
            again = semblance.HSpline.read(path)
        self.assertTrue((again.net(0) == surface.net(0)).all())
        self.assertEqual((again.patches, again.max_level, again.periodic_u), ((3, 2), 1, False))

    def test_the_mesh_lies_on_the_surface(self):
        surface = semblance.HSpline(plane_net(), max_level=0)
        vertices, triangles, uv = surface.mesh(2)
        np.testing.assert_allclose(vertices, surface.points(uv), atol=1e-12)
        self.assertEqual(triangles.shape[0], 2 * 6 * 4)
        self.assertLess(triangles.max(), len(vertices))

    def test_wrong_arrays_are_reported(self):
        surface = semblance.HSpline(plane_net())
        with self.assertRaisesRegex(semblance.InputError, r"uv is 4 x 3; expected an array of n x 2"):
            surface.points(np.zeros((4, 3)))
        with self.assertRaisesRegex(ValueError, "rows x columns x 3"):
            semblance.HSpline(np.zeros((4, 4)))
        with self.assertRaisesRegex(OSError, "nowhere.json"):
            semblance.HSpline.read("nowhere.json")

    def test_another_memory_layout_gives_the_same(self):
        surface = semblance.HSpline(plane_net())
        uv = np.random.default_rng(2).random((20, 2))
        self.assertTrue((surface.points(np.asfortranarray(uv)) == surface.points(uv)).all())
        self.assertTrue((surface.points(uv, threads=3) == surface.points(uv)).all())


    def test_copies_and_pickles_are_equal_and_independent(self):
        surface = semblance.HSpline(plane_net() + 0.1, max_level=1)
        for other in (copy.copy(surface), copy.deepcopy(surface), pickle.loads(pickle.dumps(surface))):
            self.assertEqual(other, surface)
            net = other.net(0)
            net[0, 0, 2] += 1
            other.set_net(0, net)
            self.assertNotEqual(other, surface)
        self.assertEqual(repr(surface), "<HSpline of 3 x 2 patches, levels 0 to 1>")
        self.assertEqual(str(inspect.signature(semblance.HSpline.normals)), "(self, uv, threads: int = 1, clamp: bool = False) -> numpy.ndarray")

    def test_a_uv_outside_the_domain_is_an_error_unless_clamped(self):
        surface = semblance.HSpline(plane_net())
        with self.assertRaisesRegex(semblance.InputError, r"uv: row 1 is \[0.5, 1.25\]"):
            surface.points([[0, 0], [0.5, 1.25]])
        with self.assertRaisesRegex(semblance.InputError, "row 0 has nan"):
            surface.points([[np.nan, 0]])
        np.testing.assert_array_equal(surface.points([[0.5, 1.25]], clamp=True), surface.points([[0.5, 1]]))
        np.testing.assert_array_equal(surface([0.2, 0.4], [[0.1], [0.3], [0.5]])[2, 1], surface.points([[0.4, 0.5]])[0])

    def test_exports_have_the_format_of_their_ending(self):
        surface = semblance.HSpline(plane_net())
        with tempfile.TemporaryDirectory() as folder:
            for ending, first in (("ply", b"ply"), ("glb", b"glTF"), ("vtu", b"<?xml"), ("obj", b""), ("step", b"ISO-10303-21")):
                path = os.path.join(folder, "s." + ending)
                try:
                    surface.write(path)
                except semblance.InputError as error:  # a build without OpenCASCADE
                    self.assertIn("OpenCASCADE", str(error))
                    continue
                with open(path, "rb") as file:
                    self.assertTrue(file.read().startswith(first), ending)
            with self.assertRaises(semblance.InputError):
                surface.write(os.path.join(folder, "s.txt"))


class Fit(unittest.TestCase):
    def test_a_paraboloid_within_the_tolerance(self):
        points = paraboloid(41)
        found = semblance.fit(points, fit={"plan": {"type": "adaptive", "tolerance_mm": 0.01, "finest": 3}})
        self.assertTrue(found.usable, found.faults)
        self.assertLess(found.rms_mm, 0.01)
        self.assertLess(found.residuals_mm.max(), 0.02)
        np.testing.assert_allclose(np.linalg.norm(found.surface.points(found.uv) - points, axis=1), found.residuals_mm, atol=1e-9)

    def test_heights_are_predicted_with_their_uncertainty(self):
        random = np.random.default_rng(5)
        xy = random.uniform(0, 10, (3000, 2))
        height = lambda at: 50 * np.sin(at[:, 0] / 2) + 3 * at[:, 1]
        found = semblance.fit(np.column_stack([xy, height(xy) + random.normal(0, 1, 3000)]))
        places = np.array([[3.0, 4.0], [7.0, 2.0], [30.0, 2.0]])
        there = found.predict(places, level=0.95)
        np.testing.assert_allclose(there["z"][:2], height(places)[:2], atol=0.6)
        self.assertTrue((there["low"][:2] < there["z"][:2] - 1.5).all() and (there["high"][:2] < there["z"][:2] + 2.6).all())
        self.assertTrue((there["sd"][:2] < 0.4).all())
        np.testing.assert_array_equal(there["supported"], [True, True, False])
        self.assertTrue(np.isnan(there["z"][2]))

    def test_given_parameters_are_kept(self):
        points = paraboloid(21)
        uv = (points[:, :2] + 20) / 40
        found = semblance.fit(points, uv, patches_u=4, patches_v=4)
        np.testing.assert_array_equal(found.uv, uv)

    def test_noise_and_outliers_are_those_of_the_points(self):
        random = np.random.default_rng(9)
        xy = random.uniform(-20, 20, (4000, 2))
        points = np.column_stack([xy, 3 * np.sin(xy[:, 0] / 6) + random.normal(0, 0.1, 4000)])
        points[:40, 2] += 5
        found = semblance.fit(points, attributes={"intensity": 2 * xy[:, 0]}, sigma=True)
        self.assertAlmostEqual(found.noise_mm, 0.1, delta=0.01)
        self.assertAlmostEqual(found.held_out_mm, 0.1, delta=0.03)
        np.testing.assert_array_equal(found.outliers, np.arange(40))
        used = np.setdiff1d(np.arange(4000), found.outliers)
        self.assertAlmostEqual(found.rms_mm, np.sqrt(np.mean(found.residuals_mm[used] ** 2)), delta=1e-9)
        self.assertAlmostEqual(found.rms_of_all_mm, np.sqrt(np.mean(found.residuals_mm**2)), delta=1e-9)
        np.testing.assert_allclose(found.attributes["intensity"], 2 * xy[:, 0], atol=0.05)
        np.testing.assert_allclose(found.attribute("intensity", found.uv[:9]), found.attributes["intensity"][:9], atol=1e-9)
        self.assertTrue((found.sigma_mm > 0).all() and found.sigma_mm.mean() < 0.1)
        self.assertIn("noise", found.report)
        self.assertAlmostEqual(found(3.0, 4.0), 3 * np.sin(0.5), delta=0.1)
        again = pickle.loads(pickle.dumps(found))
        self.assertEqual(again, found)
        np.testing.assert_array_equal(again.predict(xy[:9])["sd"], found.predict(xy[:9])["sd"])

    def test_exact_points_are_met_and_weights_follow_sigma(self):
        random = np.random.default_rng(10)
        points = paraboloid(31) + random.normal(0, 0.2, (961, 3)) * [0, 0, 1]
        found = semblance.fit(points, exact=[5, 480])
        np.testing.assert_allclose(found.residuals_mm[[5, 480]], 0, atol=1e-6)
        sigma = random.uniform(0.1, 0.3, 961)
        one, two = semblance.fit(points, sigma_of_points=sigma), semblance.fit(points, weights=1 / sigma**2)
        np.testing.assert_allclose(one.surface.net(0), two.surface.net(0), atol=1e-9)

    def test_a_term_of_linear_rows_holds_derivatives_and_sums(self):
        points = paraboloid(31)
        uv = (points[:, :2] + 20) / 40
        border = np.column_stack([np.zeros(9), np.linspace(0.1, 0.9, 9)])
        slope = np.tile([40.0, 0, 0], (9, 1))  # dS/du without a slope in z, where the paraboloid has one
        options = lambda terms: {"plan": {"type": "adaptive", "tolerance_mm": 0.01, "finest": 1}, "terms": ["points", *terms]}
        free = semblance.fit(points, uv, patches_u=4, patches_v=4, fit=options([])).surface
        held = semblance.fit(points, uv, patches_u=4, patches_v=4, fit=options([semblance.rows_term(border, slope, du=1, weight=1e5)])).surface
        np.testing.assert_allclose(free.derivatives(border, 1, 0)[:, 2], -16, atol=0.5)
        np.testing.assert_allclose(held.derivatives(border, 1, 0), slope, atol=0.05)
        # The two ends of a line stay as far apart in z as the row states.
        ends = np.array([[[0.0, 0.5], [1.0, 0.5]]])
        apart = semblance.rows_term(ends, [[-40, 0, 3]], coefficients=[[1, -1]], weight=1e5)
        tilted = semblance.fit(points, uv, patches_u=4, patches_v=4, fit=options([apart])).surface
        a, b = tilted.points(ends[0])
        self.assertAlmostEqual(a[2] - b[2], 3, delta=0.01)
        with self.assertRaisesRegex(semblance.InputError, "row 0: .u,v. is not in 0..1"):
            semblance.fit(points, uv, fit=options([semblance.rows_term([[1.5, 0]], [[0, 0, 0]])]))
        with self.assertRaisesRegex(semblance.InputError, "expected n x m x 2 and n x 3"):
            semblance.rows_term(border, slope[1:])

    def test_wrong_rows_are_reported(self):
        points = paraboloid(9)
        points[17, 1] = np.nan
        with self.assertRaisesRegex(semblance.InputError, "points: row 17 has nan"):
            semblance.fit(points)
        with self.assertRaisesRegex(ValueError, "weights: row 3 is 0"):
            semblance.fit(paraboloid(9), weights=[1, 1, 1, 0] + 77 * [1])
        with self.assertRaisesRegex(semblance.InputError, "exact: entry 0 is point 81"):
            semblance.fit(paraboloid(9), exact=[81])
        with self.assertRaisesRegex(semblance.InputError, "both given"):
            semblance.fit(paraboloid(9), weights=np.ones(81), sigma_of_points=np.ones(81))
        with self.assertRaises(TypeError):
            semblance.fit(paraboloid(9), patches_w=3)
        masked = np.ma.masked_greater(paraboloid(9), 30)
        masked[5, 2] = np.ma.masked
        with self.assertRaisesRegex(semblance.InputError, "points: [0-9]+ rows are masked, the first is row"):
            semblance.fit(masked)
        surface = semblance.fit(paraboloid(9))
        places = np.ma.masked_less(paraboloid(9)[:, :2], 3)
        for call in (surface.predict, lambda xy: surface(xy[:, 0], xy[:, 1]), surface.surface.points, lambda uv: surface.surface(uv[:, 0], uv[:, 1]),
                     lambda xy: surface.surface.project(np.ma.column_stack([xy, xy[:, 0]]))):
            with self.assertRaisesRegex(semblance.InputError, "rows are masked"):
                call(places)
        with self.assertRaisesRegex(semblance.InputError, "u: 1 rows are masked"):
            surface.surface(np.ma.masked, 0.5)
        with self.assertRaisesRegex(semblance.InputError, "points: Complex data not supported"):
            semblance.fit(paraboloid(9) + 1j)
        with self.assertRaisesRegex(semblance.InputError, "threads is 0"):
            semblance.fit(paraboloid(9), threads=0)

    def test_unknown_options_are_reported_with_a_suggestion(self):
        with self.assertRaisesRegex(semblance.ConfigError, "patches_w.*did you mean 'patches_[uv]'"):
            semblance.fit(paraboloid(9), patches_w=3)
        with self.assertRaisesRegex(semblance.ConfigError, "patches_u"):
            semblance.fit(paraboloid(9), patches_u="many")

    def test_the_documentation_names_each_option(self):
        for word in ("patches_u", "closure", "parameters", "tolerance_mm"):
            self.assertIn(word, semblance.fit_options())
        for thing in (semblance.fit, semblance.run, semblance.study, semblance.interpolate, semblance.scheme, semblance.HSpline):
            self.assertLessEqual(thing.__doc__.count("\n"), 60)
            self.assertGreaterEqual(len(inspect.signature(thing).parameters), 2)

    def test_other_threads_run_meanwhile(self):
        counted = [0]
        stop = threading.Event()

        def count():
            while not stop.is_set():
                counted[0] += 1
                stop.wait(0.001)

        thread = threading.Thread(target=count)
        thread.start()
        before = counted[0]
        semblance.fit(paraboloid(201), fit={"plan": {"type": "adaptive", "tolerance_mm": 1e-4, "finest": 4}})
        self.assertGreater(counted[0], before)
        stop.set()
        thread.join()


class Interpolation(unittest.TestCase):
    def test_equal_depths_give_that_depth_everywhere(self):
        vertices, triangles = sphere()
        bases = vertices[5::200]
        directions = bases / np.linalg.norm(bases, axis=1)[:, None]
        for scheme in ("kriging", "nearest", "mean", {"type": "inverse_distance", "power": 3}):
            depth, sd = semblance.interpolate(vertices, triangles, bases, directions, np.full(len(bases), 7.5), scheme)
            known = np.isfinite(depth)
            self.assertGreater(known.sum(), len(vertices) // 2)
            np.testing.assert_allclose(depth[known], 7.5, atol=1e-6)
            self.assertEqual(sd.shape, depth.shape)

    def test_faults_are_reported(self):
        vertices, triangles = sphere(rings=6)
        with self.assertRaisesRegex(semblance.InputError, "names vertex 999"):
            semblance.interpolate(vertices, [[0, 1, 999]], vertices[:2], vertices[:2], [1, 2])
        with self.assertRaisesRegex(semblance.ConfigError, "krigging.*did you mean 'kriging'"):
            semblance.interpolate(vertices, triangles, vertices[:2], vertices[:2], [1, 2], "krigging")


class Experiments(unittest.TestCase):
    QUICK = {"subject.rings": 24, "implicit.resolution": 16, "seeds.level": 0, "template.max_level": 1,
             "first_fit": [], "fit.plan.schedule": [{"level": 0, "fraction": 1}]}

    def test_a_run_returns_the_contents_of_its_files(self):
        config = os.path.join(SOURCE, "configs", "phantom.yaml")
        with tempfile.TemporaryDirectory() as folder:
            out = os.path.join(folder, "run")
            run = semblance.run(config, set=self.QUICK, out=out)
            written = semblance.HSpline.read(os.path.join(out, "face.hspline.json"))
            with self.assertRaises(semblance.IoError):
                semblance.run(config, set=self.QUICK, out=out)  # no file is replaced without force
        self.assertTrue((run.surface.net(0) == written.net(0)).all())
        self.assertTrue(run.usable)
        self.assertGreater(run["face.rms_mm"], 0)
        self.assertEqual(run.number("face.rms_mm"), run.numbers["face"]["rms_mm"])
        self.assertIsNone(run.number("face.rmss_mm"))
        with self.assertRaisesRegex(KeyError, "did you mean 'rms_mm'"):
            run["face.rmss_mm"]
        np.testing.assert_array_equal(run.face[0], run.surface.mesh(4)[0])
        self.assertEqual(len(run.depth_mm), len(run.skull[0]))
        self.assertEqual(len(run.region), len(run.truth[0]))
        again = pickle.loads(pickle.dumps(run))
        self.assertEqual(again, run)
        self.assertIn("<iframe srcdoc=", run._repr_html_())
        self.assertNotIn("<iframe", again._repr_html_())
        self.assertRegex(repr(run), r"<Result of phantom 1: (not )?usable, RMS error [0-9.]+ mm>")

    # A cached run equals one without a cache, whatever ran before.
    def test_a_cache_changes_no_result(self):
        config, cache = os.path.join(SOURCE, "configs", "phantom.yaml"), semblance.Cache(stages=30)
        quick = {**self.QUICK, "subject.rings": 20, "uncertainty.sigma": False}
        for changed in ({}, {"fit.plan.schedule": [{"level": 0, "fraction": 0.5}]}, {"interp": "mean"}, {"subject.random_seed": 2}):
            self.assertEqual(semblance.run(config, set={**quick, **changed}, cache=cache), semblance.run(config, set={**quick, **changed}))
        made = cache._stages.made
        semblance.run(config, set={**quick, "fit.plan.schedule": [{"level": 1, "fraction": 0.5}]}, cache=cache)
        semblance.run(config, set=quick, cache=cache)
        self.assertEqual(cache._stages.made, made)
        self.assertEqual(repr(cache), f"<cache, {made} stages made>")

    def test_a_cache_notices_changed_files_and_schemes(self):
        def mean_scheme(factor):
            @semblance.scheme("own")
            def own(given):
                return np.full(len(given.vertices), factor * given.depths_mm.mean())
            return own

        config, cache = os.path.join(SOURCE, "configs", "phantom.yaml"), semblance.Cache()
        quick = {**self.QUICK, "subject.rings": 20, "uncertainty.sigma": False}
        one, other = mean_scheme(1), mean_scheme(1.5)
        own = [semblance.run(config, set={**quick, "interp": "own"}, schemes=[scheme], cache=cache).depth_mm for scheme in (one, other, one)]
        np.testing.assert_allclose(own[1], 1.5 * own[0])
        np.testing.assert_array_equal(own[2], own[0])
        with open(os.path.join(SOURCE, "configs", "tables", "rhine_black.yaml")) as file:
            text = file.read()
        with tempfile.TemporaryDirectory() as folder:
            table, depths = os.path.join(folder, "table.yaml"), []
            for mean in ("5.00", "8.00"):  # of supraglabella
                with open(table, "w") as file:
                    file.write(text.replace("normal_male: {mean: 5.00}", f"normal_male: {{mean: {mean}}}", 1))
                given = {**quick, "tissue.depths": "table", "tissue.table": table}
                depths.append(semblance.run(config, set=given, cache=cache).depth_mm)
                np.testing.assert_array_equal(depths[-1], semblance.run(config, set=given).depth_mm)
        self.assertGreater(np.nanmax(depths[1] - depths[0]), 1)
        with self.assertRaisesRegex(TypeError, "semblance.Cache"):
            semblance.run(config, cache=True)
        with self.assertRaisesRegex(semblance.InputError, "at least 1"):
            semblance.Cache(0)

    def write_study(self, folder):
        study = os.path.join(folder, "study.yaml")
        with open(study, "w") as file:
            file.write("base: %s\njob: depth\ngrid: {interp: [nearest, mean]}\nset: {subject.rings: 24}\n"
                       "metric: depth_truth.along_direction.rms_mm\n" % os.path.join(SOURCE, "configs", "phantom.yaml"))
        return study

    def test_a_study_returns_its_long_table(self):
        with tempfile.TemporaryDirectory() as folder:
            study = self.write_study(folder)
            table = semblance.study(study, os.path.join(folder, "out"))
            here = os.getcwd()
            found = semblance.study(os.path.join(folder, "out"))
            self.assertEqual(len(found), len(table))
            with self.assertRaisesRegex(semblance.IoError, "no plan.json"):
                semblance.study(folder)
            with self.assertRaisesRegex(semblance.InputError, "omit 'out'"):
                semblance.study(os.path.join(folder, "out"), out="elsewhere")
            os.chdir(folder)  # contains out/study
            try:
                again = semblance.study("study.yaml")
                self.assertTrue(os.path.isfile("out/study/trials.csv"))
            finally:
                os.chdir(here)
        self.assertEqual(len(again), len(table))
        rows = table if isinstance(table, list) else table.to_dict("records")
        self.assertEqual({row["interp"] for row in rows}, {"nearest", "mean"})
        self.assertTrue(all(row["status"] == "done" and isinstance(row["value"], float) for row in rows))

    def test_a_wide_table_has_one_row_per_trial(self):
        with tempfile.TemporaryDirectory() as folder:
            wide = semblance.study(self.write_study(folder), os.path.join(folder, "out"), wide=True)
            long = semblance.study(os.path.join(folder, "out"))
            os.remove(os.path.join(folder, "out", "trials_wide.csv"))
            with self.assertRaisesRegex(semblance.IoError, "semblance report"):
                semblance.study(os.path.join(folder, "out"), wide=True)
        wide, long = (table if isinstance(table, list) else table.to_dict("records") for table in (wide, long))
        self.assertEqual(len(wide), 2)
        for row in wide:
            same = [other["value"] for other in long if other["interp"] == row["interp"] and other["metric"] == "depth_truth.along_direction.rms_mm"]
            self.assertEqual(same, [row["depth_truth.along_direction.rms_mm"]])

    def test_a_study_runs_trials_again_only_if_asked(self):
        with tempfile.TemporaryDirectory() as folder:
            study, out = self.write_study(folder), os.path.join(folder, "out")

            def written(**options):
                semblance.study(study, out, **options)
                trials = os.path.join(out, "trials")
                return {name: os.stat(os.path.join(trials, name, "trial.json")).st_mtime_ns for name in os.listdir(trials)}

            first, kept, again = written(), written(), written(rerun="all")
            with self.assertRaisesRegex(semblance.ConfigError, "'fialed' is none of failed, unusable"):
                semblance.study(study, out, rerun="fialed")
            with self.assertRaisesRegex(semblance.InputError, "need its YAML file"):
                semblance.study(out, rerun="all")
        self.assertEqual(kept, first)
        self.assertTrue(all(again[name] > first[name] for name in first))

    def test_wrong_arguments_name_the_remedy(self):
        def plain(given):
            return given.depths_mm

        with self.assertRaisesRegex(TypeError, "decorate the function with @semblance.scheme"):
            semblance.study("study.yaml", schemes=[plain])
        with self.assertRaisesRegex(TypeError, "decorate the function with @semblance.metric"):
            semblance.study("study.yaml", metrics=[plain])
        for call in (semblance.run, semblance.study):
            with self.assertRaisesRegex(TypeError, "path of a YAML file"):
                call({"base": "phantom.yaml"})
        with tempfile.TemporaryDirectory() as folder:
            open(os.path.join(folder, "a file"), "w").close()
            with self.assertRaisesRegex(semblance.IoError, "pass force=True"):
                semblance.run(os.path.join(SOURCE, "configs", "phantom.yaml"), out=folder)

    def test_ctrl_c_ends_a_study_between_its_trials(self):
        with tempfile.TemporaryDirectory() as folder:
            study, out = os.path.join(folder, "study.yaml"), os.path.join(folder, "out")
            with open(study, "w") as file:
                file.write("base: %s\njob: depth\ngrid: {subject.random_seed: %s}\nset: {subject.rings: 24}\n"
                           "metric: depth_truth.along_direction.rms_mm\n" % (os.path.join(SOURCE, "configs", "phantom.yaml"), list(range(1, 401))))
            trials = os.path.join(out, "trials")

            def interrupt_after_the_first():
                while not os.path.isdir(trials) or not os.listdir(trials):
                    time.sleep(0.01)
                os.kill(os.getpid(), signal.SIGINT)

            threading.Thread(target=interrupt_after_the_first, daemon=True).start()
            with self.assertRaises(KeyboardInterrupt):
                semblance.study(study, out)
            self.assertLess(len(os.listdir(trials)), 400)


if __name__ == "__main__":
    unittest.main()
