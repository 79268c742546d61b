#!/usr/bin/python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Prints what each step of a job costs, and the ten functions that take most of the time.
    profile.py PROGRAM SOURCE [JOB...]   jobs: demo vhm cthead trial (the second trial of a study)
SOURCE is the folder of the project. Real heads lie beside it; their jobs are skipped where they are missing. Functions are sampled by
libprofiler of google-perftools, which needs no privileges."""
import json
import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path

SAMPLES_PER_S = 250
HEADS = "../shared/data"
STUDY = "base: {source}/configs/heads/vhm.yaml\nset: {{bust: none}}\ngrid: {{implicit.resolution: [90, 91]}}\nkeep: summary\n"


def call(program, words, samples):
    """Runs the program, whose samples go to the file. Exit code 1 is a face that is not usable."""
    environment = {**os.environ, "LD_PRELOAD": "libprofiler.so.0", "CPUPROFILE": str(samples), "CPUPROFILE_FREQUENCY": str(SAMPLES_PER_S)}
    done = subprocess.run([program, *words], env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    if done.returncode > 1 or not samples.exists():
        sys.exit(f"profile.py: {' '.join(map(str, words))}: {done.stderr.strip()}")


def without_arguments(name):
    """The name of a function without the arguments of its templates and of its call."""
    depth, plain = 0, ""
    for character in name:
        depth += (character in "<(") - (character in ">)")
        plain += character if depth == 0 and character not in ">)" else ""
    return plain.strip()


def short(name):
    """The work of a thread appears as a lambda in a std::function; it is named after the function that holds it."""
    name = re.sub(r" \[clone [^]]*\]|\(anonymous namespace\)", "", name).replace("::::", "::").replace("semblance::", "")
    task = re.search(r"([\w:~]+)(\([^{]*\))?::\{lambda", name)
    return task[1] + " (task)" if task else without_arguments(name).split(",")[0]


def hottest(program, samples, count=10):
    text = subprocess.run(["google-pprof", "--text", "--no_strip_temp", program, samples], capture_output=True, text=True).stdout
    rows, total = {}, 1
    for line in text.splitlines():
        if line.startswith("Total:"):
            total = int(line.split()[1])
        elif len(fields := line.split(None, 5)) == 6:
            rows[short(fields[5])] = rows.get(short(fields[5]), 0) + int(fields[0])
    first = sorted(rows.items(), key=lambda row: -row[1])[:count]
    return [(name, taken / total) for name, taken in first]


def print_steps(timing):
    print(f"  {'step':28s} {'CPU s':>6s} {'wall s':>6s} {'peak MB':>7s}")
    for step in timing["steps"]:
        print(f"  {step['step']:28s} {step['cpu_s']:6.2f} {step['wall_s']:6.2f} {step['peak_mb']:7.0f}")
    print(f"  {'all':28s} {timing['cpu_s']:6.2f} {timing['total_wall_s']:6.2f}")


def profile_run(program, config, folder):
    samples = folder / "samples"
    call(program, ["run", config, "--out", folder / "out", "--quiet"], samples)
    return json.loads((folder / "out/timing.json").read_text()), samples


def profile_second_trial(program, source, folder):
    """The steps of the trial alone; the functions of the whole study, which cannot be told apart."""
    (folder / "study.yaml").write_text(STUDY.format(source=source))
    samples = folder / "samples"
    call(program, ["study", folder / "study.yaml", "--out", folder / "out", "--jobs", "1", "--quiet"], samples)
    trials = [trial["id"] for trial in json.loads((folder / "out/plan.json").read_text())["trials"]]
    return json.loads((folder / "out/trials" / trials[1] / "timing.json").read_text()), samples


def profile(program, source, job):
    head = "cthead" if job == "cthead" else "vhm"
    if job != "demo" and not (source / HEADS / head / "skull.ply").exists():
        print(f"{job}: skipped, because there is no {HEADS}/{head}")
        return
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        config = source / ("configs/demo.yaml" if job == "demo" else f"configs/heads/{head}.yaml")
        timing, samples = profile_second_trial(program, source, folder) if job == "trial" else profile_run(program, config, folder)
        print(job)
        print_steps(timing)
        for function, share in hottest(program, samples):
            print(f"  {100 * share:5.1f} %  {function}")


def main():
    program, source, *jobs = sys.argv[1:]
    for job in jobs or ["demo", "vhm", "cthead", "trial"]:
        profile(program, Path(source).resolve(), job)


if __name__ == "__main__":
    main()
