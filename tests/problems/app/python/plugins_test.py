# SPDX-License-Identifier: GPL-3.0-or-later
"""Tests schemes and metrics in Python against the built-in ones, and from files on the command line."""
import contextlib
import inspect
import io
import copy
import json
import os
import pathlib
import pickle
import sys
import tempfile
import unittest

import numpy as np
import semblance
from semblance.__main__ import main
from semblance.testing import check_scheme

SOURCE = os.path.abspath(sys.argv.pop())
PHANTOM = os.path.join(SOURCE, "configs", "phantom.yaml")
RMS = "depth_truth.along_direction.rms_mm"


@semblance.scheme("shepard", power=3.0)
def shepard(given, power):
    """Shepard's weights."""
    distance = np.linalg.norm(given.vertices[:, None] - given.bases, axis=2)
    weights = np.maximum(distance, 1e-9) ** -power
    return weights @ given.depths_mm / weights.sum(axis=1)


PLUGIN = '''
import numpy as np, semblance
@semblance.scheme("level", factor=1.0, fail=False)
def level(given, factor, fail):
    if fail:
        raise RuntimeError("no depth today")
    return np.full(len(given.vertices), factor * given.depths_mm.mean())
@semblance.metric("mean_depth_mm")
def mean_depth_mm(result):
    return np.nanmean(result.depth_mm)
'''


class Study(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.root = pathlib.Path(self.folder.name)

    def write(self, text, name="study.yaml"):
        (self.root / name).write_text(text)
        return str(self.root / name)

    def study(self, grid, more=""):
        return self.write(f"base: {PHANTOM}\njob: depth\nset: {{subject.rings: 24}}\ngrid: {{interp: [{grid}]}}\nmetric: {RMS}\n{more}")

    def rows(self, table):
        rows = table if isinstance(table, list) else table.to_dict("records")
        return {(row["interp"], row["metric"]): float(row["value"]) for row in rows if row["value"] not in ("", None)}

    def test_shepard_in_python_equals_the_built_in_scheme(self):
        grid = "{type: inverse_distance, power: 4, max_angle_deg: 180}, {type: shepard, power: 4}, mean"
        values = self.rows(semblance.study(self.study(grid), self.root / "out", jobs=2, schemes=[shepard]))
        built_in, own = "inverse_distance power=4 max_angle_deg=180", "shepard power=4"
        compared = [metric for interp, metric in values if interp == built_in]
        self.assertIn("cross_validation.landmark.rms_mm", compared)
        for metric in compared:
            self.assertAlmostEqual(values[own, metric], values[built_in, metric], delta=1e-6, msg=metric)

    def test_a_metric_is_a_number_of_each_trial(self):
        @semblance.metric("deepest_mm")
        def deepest_mm(result):
            self.assertIsNone(result.face)
            self.assertEqual(len(result.depth_mm), len(result.skull[0]))
            self.assertEqual(result.number(RMS), result.numbers["depth_truth"]["along_direction"]["rms_mm"])
            return np.nanmax(result.depth_mm)

        values = self.rows(semblance.study(self.study("nearest, mean"), self.root / "out", metrics=[deepest_mm]))
        self.assertGreater(values["nearest", "deepest_mm"], values["mean", "deepest_mm"])

    def test_an_exception_fails_only_its_trial_and_keeps_the_traceback(self):
        self.write(PLUGIN, "mine.py")
        with self.assertWarnsRegex(UserWarning, "1 of 2 trials failed"):
            table = semblance.study(self.study("{type: level, fail: true}, level", "plugins: [mine.py]\n"), self.root / "out")
        rows = table if isinstance(table, list) else table.to_dict("records")
        status = {row["interp"]: (row["status"], row["trial"]) for row in rows}
        self.assertEqual(status["level"][0], "done")
        failed, trial = status["level fail=true"]
        self.assertEqual(failed, "failed")
        reason = json.loads((self.root / "out" / "trials" / trial / "trial.json").read_text())["reason"]
        self.assertEqual(reason, "level: RuntimeError: no depth today")
        self.assertIn("mine.py", (self.root / "out" / "trials" / trial / "traceback.txt").read_text())

    def test_a_scheme_without_a_single_depth_fails_and_one_with_some_is_noted(self):
        nothing = semblance.scheme("nothing")(lambda given: np.full(len(given.vertices), np.nan))
        near = semblance.scheme("near")(lambda given: np.where(given.vertices[:, 2] > 0, 5.0, np.nan))
        with self.assertWarnsRegex(UserWarning, "1 of 2 trials failed"):
            table = semblance.study(self.study("nothing, mean"), self.root / "out", schemes=[nothing], wide=True)
        rows = table if isinstance(table, list) else table.to_dict("records")
        self.assertEqual({row["interp"]: row["status"] for row in rows}, {"nothing": "failed", "mean": "done"})
        with self.assertRaisesRegex(semblance.InputError, "nothing gave no depth to any of the"):
            semblance.run(PHANTOM, set={"interp": "nothing", "subject.rings": 24, "implicit.resolution": 16}, schemes=[nothing])
        found = semblance.run(PHANTOM, set={"interp": "near", "subject.rings": 24, "implicit.resolution": 16}, schemes=[near])
        self.assertEqual(len([note for note in found.notes if "near gave no depth to" in note]), 1)

    def test_trials_without_a_finite_metric_are_named(self):
        study = self.write(f"base: {PHANTOM}\njob: depth\nset: {{subject.rings: 24}}\ngrid: {{interp: [mean, nearest]}}\nmetric: odd\nplugins: [mine.py]\n")
        for value, words in (("np.nan", "no trial has the number 'odd'"), ("np.nan if np.ptp(result.depth_mm) == 0 else 1.0", "1 of 2 trials that are done has no finite number 'odd'")):
            self.write(f"import numpy as np, semblance\n@semblance.metric('odd')\ndef odd(result):\n    return {value}\n", "mine.py")
            with contextlib.redirect_stdout(io.StringIO()) as told:
                main(["study", study, "--out", str(self.root / str(len(words)))])
            self.assertIn(words, told.getvalue())

    def test_the_command_states_why_trials_failed_and_runs_them_again(self):
        self.write(PLUGIN, "mine.py")
        study = self.study("{type: level, fail: true}, mean", "plugins: [mine.py]\n")
        for more, counts in (([], "0 existed, 1 done, 1 failed"), (["--rerun", "all"], "0 existed, 1 done, 1 failed")):
            with contextlib.redirect_stdout(io.StringIO()) as told:
                self.assertEqual(main(["study", study, "--out", str(self.root / "out"), *more]), 1)
            self.assertIn("level fail=true: level: RuntimeError: no depth today", told.getvalue())
            self.assertIn(counts, told.getvalue())

    def test_schemes_and_metrics_of_a_module_are_copied_and_pickled_by_name(self):
        self.assertIs(pickle.loads(pickle.dumps(shepard)), shepard)
        self.assertIs(copy.deepcopy(shepard), shepard)

    def test_the_command_loads_plugins_and_another_source_makes_other_trials(self):
        study = self.study("level", "plugins: [mine.py]\n")
        printed = []
        for text, out in ((PLUGIN, "one"), (PLUGIN, "one"), (PLUGIN + "# changed\n", "two")):
            self.write(text, "mine.py")
            with contextlib.redirect_stdout(io.StringIO()) as told:
                self.assertEqual(main(["study", study, "--out", str(self.root / out)]), 0)
            printed.append(told.getvalue())
        self.assertIn("1 trials, 0 existed, 1 done", printed[0])
        self.assertIn("1 trials, 1 existed, 0 done", printed[1])
        self.assertNotEqual(*(os.listdir(self.root / out / "trials") for out in ("one", "two")))

    def test_the_shards_of_a_study_are_its_trials(self):
        self.write(PLUGIN, "mine.py")
        study = self.study("level, mean, nearest", "plugins: [mine.py]\n")
        for index in (0, 1):
            with contextlib.redirect_stdout(io.StringIO()):
                self.assertEqual(main(["study", study, "--out", str(self.root / "out"), "--shard", f"{index}/2"]), 0)
        self.assertEqual(len(os.listdir(self.root / "out" / "trials")), 3)

    def test_wrong_results_are_refused(self):
        wrong = {"returned 2 depths": lambda given: [1.0, 2.0], "depth of vertex 0 is -1 mm": lambda given: np.full(len(given.vertices), -1.0),
                 "return one number per vertex": lambda given: np.ones((len(given.vertices), 3))}
        vertices = [[0, 0, 0], [10, 0, 0], [0, 10, 0.0]]
        for words, function in wrong.items():
            own = semblance.scheme("wrong")(function)
            with self.assertRaisesRegex((semblance.InputError, semblance.PluginError), words):
                semblance.interpolate(vertices, [[0, 1, 2]], vertices[:1], [[0, 0, 1]], [5], own)

    def test_an_own_scheme_takes_options_in_interpolate(self):
        vertices, bases = np.array([[0, 0, 0], [10, 0, 0], [0, 10, 0.0]]), np.array([[1.0, 0, 0], [9, 0, 0]])
        for given, power in (({"type": shepard, "power": 1}, 1), (shepard, 3)):
            depth, _ = semblance.interpolate(vertices, [[0, 1, 2]], bases, [[0, 0, 1]] * 2, [5, 7], given)
            weights = np.linalg.norm(vertices[:, None] - bases, axis=2) ** -power
            np.testing.assert_allclose(depth, weights @ [5, 7] / weights.sum(axis=1), rtol=1e-12)

    def test_names_and_options_are_checked(self):
        vertices = [[0, 0, 0], [10, 0, 0], [0, 10, 0.0]]
        with self.assertRaisesRegex(semblance.InputError, "'kriging'"):
            semblance.run(PHANTOM, schemes=[semblance.scheme("kriging")(lambda given: given)])
        with self.assertRaisesRegex(semblance.UnknownOptionError, "did you mean 'power'"):
            semblance.study(self.study("{type: shepard, powr: 4}"), self.root / "out", schemes=[shepard])
        with self.assertRaisesRegex(semblance.ConfigError, "'shepart'.*kriging.*shepard; did you mean 'shepard'"):
            semblance.study(self.study("shepart"), self.root / "out", schemes=[shepard])
        with self.assertRaisesRegex(semblance.InputError, "'flat': its function cannot be called"):
            semblance.scheme("flat", power=2)(lambda given: given)
        with self.assertRaisesRegex(semblance.InputError, "option 'list' is a list"):
            semblance.interpolate(vertices, [[0, 1, 2]], vertices[:1], [[0, 0, 1]], [5], semblance.scheme("a", list=[])(lambda given, list: 1))
        with self.assertRaisesRegex(semblance.InputError, "'power' is taken|metric 'depth'"):
            semblance.study(self.study("mean"), self.root / "out", metrics=[semblance.metric("depth")(lambda result: 1)])


class Laws(unittest.TestCase):
    def test_built_in_formulas_obey_them(self):
        check_scheme(shepard)
        self.assertEqual(list(inspect.signature(shepard).parameters), ["given", "power"])
        check_scheme(semblance.scheme("middle")(lambda given: np.full(len(given.vertices), given.depths_mm.mean())), exact=False)

    def test_a_scheme_that_jumps_may_obey_them(self):
        def nearest3(given):
            distance = np.linalg.norm(given.vertices[:, None] - given.bases, axis=2)
            return given.depths_mm[np.argsort(distance, axis=1)[:, :3]].mean(axis=1)

        check_scheme(semblance.scheme("nearest3")(nearest3), exact=False)

    def test_a_broken_law_is_named(self):
        broken = {"order of the markers": lambda given: np.full(len(given.vertices), given.depths_mm[0]),
                  "rotation and a shift": lambda given: given.vertices[:, 0] + 100,
                  "depth at a marker": lambda given: np.full(len(given.vertices), given.depths_mm.mean()),
                  "equal depths": lambda given: np.full(len(given.vertices), 3.0)}
        for words, function in broken.items():
            with self.assertRaisesRegex(AssertionError, words):
                check_scheme(semblance.scheme("broken")(function))


if __name__ == "__main__":
    unittest.main()
