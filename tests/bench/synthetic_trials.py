# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes the folder of a study with synthetic trials, to measure plan, status, merge and report at scale without running the trials.

    synthetic_trials.py PROGRAM STUDY OUT [--shards N]

The program runs the first trial of the study and writes plan.json. Each other trial has the files of the first one: its own id, subject,
axes and value of the metric, and numbers from one of 200 random variants. Their trial.json have valid hashes, so that no command can
tell them from real ones. With --shards, trial k goes to OUT/shard<k % N>, as `study --shard` would put it.
"""

import argparse
import hashlib
import json
import os
import random
import shutil
import subprocess
import zlib

PLACEHOLDER = 98765.4321  # stands for the metric until a trial sets its own value
NOT_HASHED = ("trial_sha256", "version", "program", "libraries")


def vary(value, noise):
    """Returns the value with every number that has a fraction multiplied by 1 +- 5 %."""
    if isinstance(value, dict):
        return {key: vary(inner, noise) for key, inner in value.items()}
    if isinstance(value, list):
        return [vary(inner, noise) for inner in value]
    return value * (1 + 0.05 * noise.uniform(-1, 1)) if isinstance(value, float) else value


def set_number(result, path, value):
    *parents, leaf = path.split(".")
    for parent in parents:
        result = result[parent]
    result[leaf] = value


def forms(members):
    """Returns the text of members as a file has it, and the text that is hashed, both without the outer braces."""
    return json.dumps(members, indent=1, ensure_ascii=False)[1:-1].rstrip("\n"), json.dumps(members, separators=(",", ":"), ensure_ascii=False)[1:-1]


class Variants:
    """The first trial's members after its axes, in many random forms."""

    def __init__(self, first, metric, count=200):
        body = {key: value for key, value in first.items() if key not in ("id", "subject", "axes", *NOT_HASHED)}
        self.parts = []
        for n in range(count):
            varied = dict(body, result=vary(body["result"], random.Random(n)))
            set_number(varied["result"], metric, PLACEHOLDER)
            self.parts.append(tuple(text.split(str(PLACEHOLDER)) for text in forms(varied)))
        self.end = forms({key: first[key] for key in NOT_HASHED[1:]})[0]

    def text(self, head, value):
        """Returns a whole trial.json."""
        shown, bare = self.parts[zlib.crc32(head["id"].encode()) % len(self.parts)]
        shown_head, bare_head = forms(head)
        own = repr(value)
        digest = hashlib.sha256(("{" + bare_head + "," + own.join(bare)).encode()).hexdigest()
        return "{" + shown_head + "," + own.join(shown) + f',\n "trial_sha256": "{digest}",' + self.end + "\n}\n"


def metric_of(trial, base):
    """Returns a value with an effect of the subject, one of the treatment, and noise."""
    effect = lambda text: random.Random(text).gauss(0, 1)
    return base * (1 + 0.1 * effect(trial["subject"]) + 0.05 * effect("|".join(trial["values"])) + 0.03 * effect(trial["id"])) + 1e-9


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("program"), parser.add_argument("study"), parser.add_argument("out")
    parser.add_argument("--shards", type=int, default=1)
    a = parser.parse_args()
    root = lambda k: os.path.join(a.out, f"shard{k % a.shards}") if a.shards > 1 else a.out
    subprocess.run([a.program, "study", a.study, "--out", root(0), "--shard", "0/100000", "--quiet"], check=True)
    with open(os.path.join(root(0), "plan.json")) as file:
        plan = json.load(file)
    first = os.path.join(root(0), "trials", plan["trials"][0]["id"])
    with open(os.path.join(first, "trial.json")) as file:
        trial = json.load(file)
    base = trial["result"]
    for key in plan["metric"].split("."):
        base = base[key]
    variants = Variants(trial, plan["metric"])
    for k in range(1, a.shards):
        os.makedirs(root(k), exist_ok=True)
        shutil.copy(os.path.join(root(0), "plan.json"), root(k))
    with open(os.path.join(first, "timing.json")) as file:
        timing = file.read()
    for k, entry in enumerate(plan["trials"]):
        folder = os.path.join(root(k), "trials", entry["id"])
        os.makedirs(folder, exist_ok=True)
        head = {"id": entry["id"], "subject": entry["subject"], "axes": dict(zip(plan["axes"], entry["values"]))}
        with open(os.path.join(folder, "trial.json"), "w") as file:
            file.write(variants.text(head, metric_of(entry, base)))
        with open(os.path.join(folder, "timing.json"), "w") as file:
            file.write(timing)


main()
