#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Options in pairs: what `check` lets pass, the program can do.

usage: pairwise.py PROGRAM CONFIGS [--kind experiment|fit] [--cases N] [--share SECONDS] [--seed N|day] [--keep FOLDER]

Cases are made from the schema of the options: every pair of choices (words, variants, booleans, terms) that can stand
together is in one of them, and every number is at each end of its range in one. A case is run on the smallest phantom
(or on 120 points of a height field) with one thread. What may come of it:

    refused   by `check`, at once, with exit code 2. The option that it names is then left out, until what is left
              passes; a pair that is refused with all else at its default counts as refused.
    done      exit code 0; every number of the result is finite
    said      exit code 1, and why
    SHORT     anything else: refused only after `check` let it pass, a crash, a number that is not finite, over ten
              times the median of the processor time

Prints a table, and each case that fell short with its configuration; ends with 1 if there is one. --cases: the first so
many, which cover the most. --share: those that so many seconds of processor are enough for, which a busy machine does not
change; a median of less than 2 s then counts as 2 s.
"""
import argparse
import itertools
import json
import math
import os
import pathlib
import random
import re
import resource
import shutil
import statistics
import subprocess
import sys
import tempfile
import time

from option_space import CoveringArray, OptionSpace

LIMIT_S = 60  # of processor time; a case that needs more is killed
BATCH, BATCH_OF_SHARE = 48, 8  # cases that one call of check looks at
SHARE_MEDIAN_S = 2
# Of 20 passes over the published schedule, which are more of the same work.
FEW_PASSES = {("fit", "plan", "max_passes"): 2, ("fit", "plan", "schedule"): [{"level": 0}, {"level": 1, "fraction": 0.5}]}
EXCHANGES = 12  # turns in which a choice that is refused may be exchanged for another; then it is left out


def experiment_space(schema, folder):
    steps = [{"level": 0}, {"level": 1, "fraction": 0.5}]
    return OptionSpace(
        schema,
        lists={
            "first_fit": [[], steps[:1]],
            "fit.plan[listed].schedule": [steps[:1], steps],
            "fit.plan[until].schedule": [steps],
            "interp[auto].schemes": [["mean", "nearest"], ["kriging", "barycentric"], ["surface_matern"], ["harmonic"]],
            "region.exclude": [[], [{"site": "zy_r", "radius_mm": 5}]],
            "tissue.set_mm": [{}, {"g": 5}],
            "sites": [{}, {"mine": {"near": ["n", "rhi"], "depth": 4}}],
            "rules.points": [{}],
            "alternatives": [[]],
        },
        # More rings, vertices, levels, rounds and draws are more work in proportion, which is what they ask for.
        work={
            "subject[phantom].rings": [16, 20], "patches_u": [4, 8], "patches_v": [4, 8],
            "template[formula].max_level": [0, 2], "fit.plan[adaptive].finest": [0, 2], "fit.plan[auto].finest": [0, 2],
            "fit.plan[coarse_to_fine].finest": [0, 1], "seeds.level": [0, 2], "uncertainty.samples": [0, 3],
            ".sweeps": [0, 2], ".max_passes": [1, 3], "rounds": [1, 3], "estimate.rounds": [3, 5], ".surface_points": [0, 300],
            "field.centres": [0, 40], "prior[ict].count": [1, 60], "edge_mm": [2, 20], "alpha_mm": [10, 200],
            "edges.tolerance": [1e-6, 0.5], "random_seed": [0, 7], "probe_mm": [5, 50],
            "outside[constant].depth_mm": [2, 100],  # emitters grow with its inverse square
            # At these ends it hangs on the head whether anything is left: the trial says that nothing is.
            ".max_angle_deg": [60, 180], "region.reach_mm": [30, 200], "landmarks.max_distance_mm": [5, 50], "landmarks.keep[random].n": [8, 30],
            "landmarks.keep[spread].n": [8, 30], "implicit.resolution": [12, 24], ".decay": [3, 12],
        },
        beside={
            ("face", "reference"): [("template", "file")],
            ("face", "prior"): [("template", "ict")],
            ("face", "prior_then_fit"): [("template", "ict")],
            ("face", "joint"): [("template", "ict"), ("fit.plan", "listed")],
            ("bust", "ict"): [("template", "ict")],
            ("fit.terms#0", "prior_shape"): [("face", "prior_then_fit")],
            ("fit.terms#1", "prior_shape"): [("face", "prior_then_fit")],
        },
        files={
            ("tissue.depths", "table"): {("tissue", "table"): str(folder["configs"] / "tables/rhine_caucasoid.yaml")},
            ("interp", "depth_map"): {("interp", "file"): str(folder["first"] / "depth.ply")},
            ("subject", "files"): {("subject", "skull"): str(folder["first"] / "depth.ply"),
                                   ("subject", "skin"): str(folder["first"] / "face.ply"),
                                   ("subject", "landmarks"): str(folder["first"] / "landmarks.csv")},
            ("face", "reference"): {("face", "landmarks"): str(folder["first"] / "landmarks.csv")},
            ("landmarks.keep", "names"): {("landmarks", "keep", "sites"): ["g", "n", "rhi", "go_l", "go_r", "zy_l", "zy_r"]},
            ("template", "file"): {("template", "surface"): str(folder["first"] / "face.hspline.json")},
            ("fit.plan", "until"): FEW_PASSES,
            ("fit.plan", "coarse_to_fine"): {("fit", "plan", "finest"): 1},
        },
        defaults={"template": "formula", "fill": "none", "tissue.depths": "measured", "implicit.emitter": "flat"})


def fit_space(schema, folder):
    steps = [{"level": 0}, {"level": 1, "fraction": 0.5}]
    return OptionSpace(
        schema,
        lists={"fit.plan[listed].schedule": [steps[:1], steps], "fit.plan[until].schedule": [steps]},
        work={"patches_u": [1, 6], "patches_v": [1, 6], ".finest": [0, 2], ".sweeps": [0, 2], ".max_passes": [1, 3], "[adaptive].margin": [0, 2],
              "rounds": [1, 3], "chord_mm": [0.01, 1000], "fit.plan[auto].finest": [0, 3]},
        beside={}, files={("fit.plan", "until"): FEW_PASSES}, defaults={"parameters": "given", "fit.plan": "listed", "fit.solver": "ceres"})


BASE = {
    "experiment": """base: {configs}/phantom.yaml
subject: {{type: phantom, rings: 16}}
implicit: {{resolution: 16, target_triangles: 400}}
template: {{type: formula, max_level: 1, patches_u: 6, patches_v: 6}}
seeds: {{level: 0}}
first_fit: []
fit: {{plan: {{type: listed, schedule: [{{level: 0}}, {{level: 1}}]}}}}
""",
    "fit": "patches_u: 4\npatches_v: 4\nparameters: given\n"
           "fit: {{plan: {{type: listed, schedule: [{{level: 0}}, {{level: 1}}]}}, solver: ceres, terms: [points, {{type: smoothness, weight: 1e-4}}]}}\n",
}
LIST_DEFAULTS = {"experiment": {"fit.terms": [{"type": "points"}, {"type": "smoothness"}, {"type": "membrane"}]},
                 "fit": {"fit.terms": [{"type": "points"}, {"type": "smoothness", "weight": 1e-4}]}}


def scan(draw):
    """A mesh of 11 x 11 points, for what needs triangles."""
    n = 11
    points = [f"{i / 10} {j / 10} {math.sin(0.3 * i) * j / 10 + draw.gauss(0, 0.01):.6f}" for j in range(n) for i in range(n)]
    faces = []
    for j in range(n - 1):
        for i in range(n - 1):
            a = n * j + i
            faces += [f"3 {a} {a + 1} {a + n + 1}", f"3 {a} {a + n + 1} {a + n}"]
    return ply(points, faces)


def ply(points, faces):
    head = ["ply", "format ascii 1.0", f"element vertex {len(points)}", "property double x", "property double y", "property double z",
            f"element face {len(faces)}", "property list uchar int vertex_indices", "end_header"]
    return "\n".join(head + points + faces) + "\n"


class ShareIsUsed(Exception):
    """No call is begun after the share's seconds."""


def used_s():
    """Processor seconds of this process, and of what it has called."""
    children = resource.getrusage(resource.RUSAGE_CHILDREN)
    return time.process_time() + children.ru_utime + children.ru_stime


def call(command, folder, limit_s=LIMIT_S, until_s=math.inf):
    """exit code (negative: a signal), what was printed, processor seconds"""

    def limits():
        resource.setrlimit(resource.RLIMIT_CPU, (limit_s, limit_s + 1))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))

    before_s = used_s()
    if before_s > until_s:
        raise ShareIsUsed()
    done = subprocess.run(command, cwd=folder, preexec_fn=limits, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                          stderr=subprocess.STDOUT, text=True, errors="replace")
    return done.returncode, done.stdout, used_s() - before_s


def numbers_that_are_none(json_value, path=""):
    """Where a result holds null, or a number that is not finite."""
    if isinstance(json_value, dict):
        return [p for k, v in json_value.items() for p in numbers_that_are_none(v, f"{path}.{k}")]
    if isinstance(json_value, list):
        return [p for v in json_value for p in numbers_that_are_none(v, path)]
    is_none = isinstance(json_value, float) and not math.isfinite(json_value)
    return [path] if is_none else []


def yaml(tree):
    """As JSON, but for the word that stands for a number, which a quote would make a text."""
    return json.dumps(tree).replace('"auto"', "auto") + "\n"


class Runner:
    def __init__(self, program, configs, kind, folder, until_s):
        self.program, self.configs, self.kind, self.until_s = str(program), configs, kind, until_s
        self.folder = pathlib.Path(folder)
        (self.folder / "base.yaml").write_text(BASE[kind].format(configs=configs))
        (self.folder / "study.yaml").write_text("title: one\nbase: case.yaml\nmetric: face.rms_mm\n")

    def prepare(self):
        """Files that some choices name: of a first run, and points."""
        first = self.folder / "first"
        if self.kind == "fit":
            draw = random.Random(3)
            rows = ["x,y,z,u,v"]
            for _ in range(120):
                u, v = draw.random(), draw.random()
                rows.append(f"{u:.6f},{v:.6f},{math.sin(3 * u) * v + draw.gauss(0, 0.01):.6f},{u:.6f},{v:.6f}")
            (self.folder / "points.csv").write_text("\n".join(rows) + "\n")
            (self.folder / "scan.ply").write_text(scan(draw))
            return {"configs": self.configs, "first": first}
        code, said, _ = call([self.program, "run", "base.yaml", "--out", "first", "--quiet"], self.folder)
        if code != 0:
            sys.exit(f"the first run ends with {code}: {said}")
        rows = (first / "dowels.csv").read_text().splitlines()
        table = ["site,x_mm,y_mm,z_mm,normal_x,normal_y,normal_z,depth_along_normal_mm"]
        table += [",".join(row.split(",")[:8]) for row in rows[1:]]
        (first / "landmarks.csv").write_text("\n".join(table) + "\n")
        return {"configs": self.configs, "first": first}

    def write(self, tree):
        parameters = tree.get("parameters")
        kind = parameters.get("type") if isinstance(parameters, dict) else parameters
        self.points = "scan.ply" if kind == "mesh" else "points.csv"
        (self.folder / "case.yaml").write_text(yaml({"base": "base.yaml", **tree}))

    def check(self, trees):
        """Of each: what is said against it, a line each, empty where nothing is. One process looks at all of them."""
        folder = self.folder / "cases"
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir()
        names = [f"cases/{n:04d}.yaml" for n in range(len(trees))]
        for name, tree in zip(names, trees):
            (self.folder / name).write_text(yaml({"base": "../base.yaml", **tree}))
        code, said, _ = call([self.program, "check", *names], self.folder, LIMIT_S + len(names), self.until_s)
        lines, of_base = {name: [] for name in names}, []
        for line in said.splitlines():
            name = line[:len(names[0])]
            if name in lines and not line.endswith(": no fault found") and ": warning: " not in line:
                lines[name].append(line)
            elif "base.yaml:" in line.split(" ")[0]:
                of_base.append(line)  # a fault between the case and what stands in the base: of which case?
        if of_base and len(trees) == 1:
            return [of_base + lines[names[0]]]
        if of_base:
            return self.check(trees[:len(trees) // 2]) + self.check(trees[len(trees) // 2:])
        if code not in (0, 2) or (code == 0) != (not any(lines.values())):
            if len(trees) == 1:
                return [[f"check ends with {code}: {said}"]]
            return [self.check([tree])[0] for tree in trees]  # which one it is
        return list(lines.values())

    def run(self):
        """"done", "said" or "SHORT", what was said, processor seconds"""
        subprocess.run(["rm", "-rf", "out"], cwd=self.folder, check=True)
        if self.kind == "fit":
            command = [self.program, "fit", self.points, "case.yaml", "--out", "out", "--quiet", "--threads", "1"]
            result = self.folder / "out" / "result.json"
        else:
            command = [self.program, "study", "study.yaml", "--out", "out", "--quiet"]
        code, said, cpu_s = call(command, self.folder, until_s=self.until_s)
        if self.kind != "fit":
            trials = list((self.folder / "out").glob("trials/*/trial.json"))
            result = trials[0] if trials else self.folder / "none"
        if code not in (0, 1):
            return "SHORT", f"exit code {code}: {said}", cpu_s
        if not result.exists():
            return "SHORT", f"exit code {code}, no result: {said}", cpu_s
        trial = json.loads(result.read_text())
        if trial.get("status") == "failed":
            return "SHORT", f"failed in the trial: {trial.get('reason', trial.get('error', said))}", cpu_s
        holes = numbers_that_are_none(trial)
        usable = trial.get("usable", trial.get("status") in (None, "done", "ok"))
        if usable and holes:
            return "SHORT", f"no number: {', '.join(holes[:5])}", cpu_s
        return ("done" if usable else "said"), said, cpu_s


class Search:
    def __init__(self, runner, space, seed, batch):
        self.runner, self.space, self.batch = runner, space, batch
        self.array = CoveringArray(space, seed)
        self.random = random.Random(seed + 1)
        self.refusals, self.checks, self.refused_pairs, self.judged, self.results, self.words = 0, 0, set(), set(), [], {}

    def loosened(self, case, pair, lines, exchange):
        """The case with less of what `check` said, or with other choices where it said so; None where all that is left is
        the pair, which stays."""
        held = set(self.space.closure(dict(pair or ())))
        loose = [n for n in case if n not in held]
        if not loose and not exchange:
            return None
        # One choice for each fault that is named; where none of them can go, the fault is what a held one does with any of
        # the others: half of those go.
        dropped, others = set(), {}
        for path in sorted({found.group(1) for line in lines if (found := re.match(r"\S+\.yaml[:\d]*: ([a-z_][\w.\[\]]*): ", line))}):
            at = [f.name for f in self.space.choices if f.name not in held and self.is_at(f.name, path) and self.space.exists(f, case)]
            if exchange and at and self.random.random() < 0.7:
                name = self.random.choice(at)
                others[name] = self.random.choice(self.space.by_name[name].values)
            elif at := [n for n in loose if self.is_at(n, path)]:
                dropped.add(self.random.choice(at))
        if exchange and not others:
            top = [f.name for f in self.space.choices if f.is_variant and f.name not in held and self.space.exists(f, case)]
            others = {name: self.random.choice(self.space.by_name[name].values) for name in self.random.sample(top, min(2, len(top)))}
        if not dropped and not others:
            if not loose:
                return None
            dropped = set(self.random.sample(loose, (len(loose) + 1) // 2))
        kept = self.space.without(case, dropped | set(others))
        for name, value in others.items():
            kept = self.space.closure({**kept, name: value}) or kept
        return {**kept, **self.space.closure(dict(pair or ()))}

    def repaired(self, cases):
        """Cases with the pair that each stands for, all looked at together: without what `check` refuses, or None."""
        cases = list(cases)
        open_ones = list(range(len(cases)))
        for turn in itertools.count():
            if not open_ones:
                return cases
            found = self.runner.check([self.space.tree(cases[n][0], LIST_DEFAULTS[self.runner.kind]) for n in open_ones])
            self.checks += 1
            still = []
            for n, lines in zip(open_ones, found):
                case, pair = cases[n]
                if not lines:
                    continue
                if lines[0].startswith("check ends with"):
                    self.results.append(("SHORT", case, lines[0], 0))
                    cases[n] = (None, pair)
                    continue
                self.refusals += 1
                case = self.loosened(case, pair, lines, turn < EXCHANGES)
                if case is None:
                    self.words[pair] = lines[0]
                else:
                    still.append(n)
                cases[n] = (case, pair)
            open_ones = still

    def is_at(self, name, path):
        own = ".".join(str(k) for k in self.space.by_name[name].path)
        plain = re.sub(r"\[\d+\]", "", path)
        return own == plain or own.startswith(plain + ".") or plain.startswith(own + ".")

    def run(self, case):
        self.runner.write(self.space.tree(case, LIST_DEFAULTS[self.runner.kind]))
        verdict, said, cpu_s = self.runner.run()
        self.results.append((verdict, case, said, cpu_s))
        self.tell()

    def next_cases(self, count):
        """Cases for pairs that none has covered: as they are drawn, with two numbers at an end each."""
        drawn = []
        while len(drawn) < count and (pair := self.array.next_pair()) is not None:
            case, ends = self.array.with_ends(self.array.case_for(pair), 2)
            covered = self.array.pairs_of(case) & self.array.left
            self.array.left -= covered
            drawn.append((case, pair, ends, covered))
        return drawn

    def pairs(self, most):
        while len(self.results) < most:
            drawn = self.next_cases(min(self.batch, most - len(self.results)))
            if not drawn:
                return
            settled = self.repaired([(case, pair) for case, pair, _, _ in drawn])
            for (_, pair, ends, covered), (case, _) in zip(drawn, settled):
                lost = covered - (self.array.pairs_of(case) if case is not None else set())
                if case is None:
                    self.refused_pairs.add(pair)
                    lost.discard(pair)
                self.array.give_back(lost, [e for e in ends if case is None or case.get(e[0].name) != e[1]])
                if case is not None:
                    self.run(case)
            self.forget_lone({choice for (_, pair, _, _), (case, _) in zip(drawn, settled) if case is None for choice in pair})

    def forget_lone(self, choices):
        """Of choices that were in a pair that is refused: those that are refused alone, with all their pairs."""
        new = sorted(choices - self.judged, key=repr)
        self.judged |= choices
        for (_, pair), (case, _) in zip([(None, (c,)) for c in new], self.repaired([(self.space.closure(dict([c])), (c,)) for c in new])):
            if case is None:
                gone = {p for p in self.array.left if pair[0] in p}
                self.array.left -= gone
                self.refused_pairs |= gone

    def lone_ends(self, most):
        """Numbers at an end that no case has held: each alone, which must be refused or done."""
        while self.array.ends and len(self.results) < most:
            ends, self.array.ends = self.array.ends[:self.batch], self.array.ends[self.batch:]
            settled = self.repaired([(self.space.closure({f.name: v}), ((f.name, v),)) for f, v in ends])
            for end, (case, pair) in zip(ends, settled):
                if case is None:
                    self.refused_pairs.add(pair)
                elif len(self.results) < most:
                    self.run(case)
                else:
                    self.array.ends.append(end)

    def tell(self):
        if sys.stderr.isatty() or len(self.results) % 50 == 0:
            print(f"{len(self.results)} cases, {len(self.array.left)} of {self.array.total} pairs left", file=sys.stderr)


def slow(results, least_median_s):
    median = max(least_median_s, statistics.median([r[3] for r in results if r[0] != "SHORT"] or [1]))
    return median, [("SHORT", case, f"{cpu_s:.1f} s, over ten times the median of {median:.2f} s", cpu_s)
                    for verdict, case, _, cpu_s in results if verdict != "SHORT" and cpu_s > 10 * median]


def main():
    arguments = argparse.ArgumentParser()
    arguments.add_argument("program", type=pathlib.Path)
    arguments.add_argument("configs", type=pathlib.Path)
    arguments.add_argument("--kind", choices=["experiment", "fit"], default="experiment")
    arguments.add_argument("--cases", type=int, default=10**9)
    arguments.add_argument("--share", type=float, help="processor seconds after which no case is begun")
    arguments.add_argument("--seed", type=lambda text: int(time.time() // 86400) if text == "day" else int(text), default=1,
                           help="a number, or `day` for another one each day")
    arguments.add_argument("--keep", type=pathlib.Path, help="folder for the cases that fell short")
    given = arguments.parse_args()
    start = time.monotonic()
    program, configs = given.program.resolve(), given.configs.resolve()
    schema = json.loads(subprocess.run([program, "options", given.kind, "--schema"], capture_output=True, check=True).stdout)
    with tempfile.TemporaryDirectory() as folder:
        until_s = used_s() + given.share if given.share else math.inf
        runner = Runner(program, configs, given.kind, folder, until_s)
        files = runner.prepare()
        space = (fit_space if given.kind == "fit" else experiment_space)(schema, files)
        search = Search(runner, space, given.seed, BATCH_OF_SHARE if given.share else BATCH)
        try:
            search.pairs(given.cases)
            search.lone_ends(given.cases)
        except ShareIsUsed:
            pass
    median, late = slow(search.results, SHARE_MEDIAN_S if given.share else 0)
    short = [r for r in search.results if r[0] == "SHORT"] + late
    count = lambda verdict: sum(r[0] == verdict for r in search.results)
    print(f"{given.kind}: {len(space.choices)} choices in {search.array.total} pairs, {len(space.ends)} ends of numbers")
    print(f"  cases run               {len(search.results):6d}   ({search.refusals} more were refused by check at once, in {search.checks} calls)")
    print(f"  done, finite, usable    {count('done'):6d}")
    print(f"  not usable, said why    {count('said'):6d}")
    print(f"  pairs refused by rules  {len(search.refused_pairs):6d}   left uncovered {len(search.array.left)}, ends {len(search.array.ends)}")
    print(f"  median of a case        {median:6.2f} s of processor; all in {time.monotonic() - start:.0f} s; seed {given.seed}")
    print(f"  fell short              {len(short):6d}")
    for n, (_, case, said, _) in enumerate(short):
        tree = {"base": "base.yaml", **space.tree(case, LIST_DEFAULTS[given.kind])}
        print(f"\n{said.strip()[:600]}\n  {json.dumps(tree)}")
        if given.keep:
            given.keep.mkdir(parents=True, exist_ok=True)
            (given.keep / f"{given.kind}{n:03d}.yaml").write_text(f"# {said.strip().splitlines()[0][:200]}\n{yaml(tree)}")
    return 1 if short else 0


if __name__ == "__main__":
    sys.exit(main())
