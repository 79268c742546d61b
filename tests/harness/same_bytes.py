#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Same input, same bytes: whatever the threads, the clock, the language, the folder, and the instructions of our own code.

usage: same_bytes.py PROGRAM CONFIGS [--program NAME=PROGRAM]... [--compiler NAME=PROGRAM [--compilers-only]]

A run, a depth and a fit are done in each of these ways, and their files compared with those of the first, times apart.
--program: the same, built for other instructions (make same-bytes). --compiler: built by another compiler; its numbers
may be off by 1e-9 of their size, or of 1, and so may they where the C library takes other instructions. Prints a table; ends with 1 if anything differs.
"""
import argparse
import hashlib
import json
import math
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
EXPERIMENT = """base: {phantom}
subject: {{type: phantom, rings: 20}}
implicit: {{resolution: 20, target_triangles: 1000}}
template: {{type: formula, max_level: 1}}
seeds: {{level: 0}}
first_fit: []
fit: {{plan: {{type: listed, schedule: [{{level: 0}}, {{level: 1}}]}}}}
"""
# What the C library may not use; its exp and log have other code for processors with these.
OLD_PROCESSOR = "glibc.cpu.hwcaps=-AVX512F,-AVX512VL,-AVX512BW,-AVX512DQ,-AVX2,-AVX,-FMA,-FMA4,-ERMS,-BMI2,-SSE4_2"
TIMES = ("timing.json",)


class Work:
    def __init__(self, program, configs, folder):
        self.program, self.configs, self.folder = program, configs, folder

    def files(self, folder):
        """The inputs, in a folder that must be there."""
        (folder / "job.yaml").write_text(EXPERIMENT.format(phantom=self.configs / "phantom.yaml"))
        rows = (self.configs / "fit/points.csv").read_text().splitlines()
        (folder / "points.csv").write_text("\n".join(rows[:400]) + "\n")

    def calls(self, threads):
        quiet = ["--quiet", "--threads", str(threads)]
        return {"run": ["run", "job.yaml", *quiet], "depth": ["depth", "job.yaml", *quiet], "fit": ["fit", "points.csv", *quiet]}

    def do(self, name, threads=1, program=None, env=None, folder=None, calls=None):
        """By job and file, the hash of what it holds; the folders stay."""
        folder = folder or self.folder / name
        folder.mkdir(parents=True, exist_ok=True)
        self.files(folder)
        found = {}
        for job, words in (calls or self.calls(threads)).items():
            done = subprocess.run([program or self.program, *words, "--out", job], cwd=folder, env={**os.environ, **(env or {})}, capture_output=True, text=True,
                                  errors="replace")
            if done.returncode not in (0, 1):
                return {f"{job}: exit code {done.returncode}: {done.stderr.strip()[:200]}": ""}
            for path in sorted((folder / job).rglob("*")):
                if path.is_file() and path.name not in TIMES:
                    found[f"{job}/{path.relative_to(folder / job)}"] = hashlib.sha256(path.read_bytes()).hexdigest()
        return found


def tell(what, first, other, without=()):
    names = sorted(n for n in first.keys() | other.keys() if first.get(n) != other.get(n) and pathlib.Path(n).name not in without)
    print(f"{what:<64} {len(other):4d} files {len(names):4d} differ" + (f": {', '.join(names[:4])}" if names else ""), flush=True)
    return bool(names)


def numbers(value, path=""):
    if isinstance(value, dict):
        return [n for k, v in value.items() for n in numbers(v, f"{path}.{k}")]
    if isinstance(value, list):
        return [n for k, v in enumerate(value) for n in numbers(v, f"{path}[{k}]")]
    return [(path, value)] if isinstance(value, (int, float)) and not isinstance(value, bool) else []


def numbers_of(folder):
    """All numbers of the results and the surfaces of a folder's jobs."""
    found = {}
    for job in ("run", "depth", "fit"):
        for path in sorted((folder / job).glob("*.json")):
            if path.name not in (*TIMES, "manifest.json"):  # the latter has hashes
                found |= {f"{job}/{path.name}{name}": value for name, value in numbers(json.loads(path.read_text()))}
    return found


def tell_compiler(what, first, other):
    """Results and surfaces of two folders, number by number."""
    worst, at = 0.0, ""
    one, two = numbers_of(first), numbers_of(other)
    for path in one.keys() | two.keys():
        a, b = one.get(path, math.nan), two.get(path, math.nan)
        off = abs(a - b) / max(1.0, abs(a)) if a == a and b == b else math.inf
        if off > worst:
            worst, at = off, path
    print(f"{what:<64} {len(one):4d} numbers, at most {worst:.1e} apart {at}", flush=True)
    return worst > 1e-9


def jumping_clock(folder):
    """A library that sets the clock all the time; None without a compiler."""
    library = folder / "clock_jumps.so"
    built = shutil.which("c++") and subprocess.run(["c++", "-shared", "-fPIC", "-O1", "-o", library, HERE / "clock_jumps.cc"], capture_output=True).returncode == 0
    return library if built else None


def languages():
    known = subprocess.run(["locale", "-a"], capture_output=True, text=True).stdout.split() if shutil.which("locale") else []
    return [name for name in known if name.lower().startswith(("de", "fr", "tr", "fa"))][:2]


def compare_surroundings(work, first):
    bad = [tell("the same again", first, work.do("again"))]
    for threads in (2, 4):
        bad.append(tell(f"{threads} threads", first, work.do(f"threads{threads}", threads)))
    clock = jumping_clock(work.folder)
    if clock:
        bad.append(tell("a clock that is set all the time", first, work.do("clock", env={"LD_PRELOAD": str(clock)})))
    else:
        print("a clock that is set: not tried, as c++ is not here")
    work.do("libc", env={"GLIBC_TUNABLES": OLD_PROCESSOR})  # its exp and log may be off by their last bit
    bad.append(tell_compiler("a C library without AVX and FMA", work.folder / "first", work.folder / "libc"))
    bad.append(tell("another time zone, no home", first, work.do("zone", env={"TZ": "Asia/Kathmandu", "HOME": "/nonexistent"})))
    for name in languages():
        bad.append(tell(f"the language {name}", first, work.do("language" + name, env={"LC_ALL": name, "LANG": name})))
    spaced = work.folder / "ein Ordner mit Ümläuten, 'Zeichen' & %20"
    bad.append(tell("a folder with blanks and umlauts", first, work.do("spaced", folder=spaced)))
    resolved = {job: [job, str(work.folder / f"first/{job}/resolved.yaml"), "--quiet", "--threads", "1"] for job in ("run", "depth")}
    resolved["fit"] = ["fit", "points.csv", str(work.folder / "first/fit/resolved.yaml"), "--quiet", "--threads", "1"]
    bad.append(tell("resolved.yaml, from another folder", first, work.do("resolved/elsewhere", calls=resolved)))
    return bad


def compare(work, given):
    first = work.do("first")
    bad = [] if given.compilers_only else compare_surroundings(work, first)
    for name, program in given.others:
        bad.append(tell(name, first, work.do("other_" + name, program=program)))
    for name, program in given.compiler:
        work.do("compiler_" + name, program=program)
        bad.append(tell_compiler(name, work.folder / "first", work.folder / ("compiler_" + name)))
    return any(bad)


def named(text):
    name, program = text.split("=", 1)
    return name, str(pathlib.Path(program).resolve())


def main():
    arguments = argparse.ArgumentParser()
    arguments.add_argument("program", type=pathlib.Path)
    arguments.add_argument("configs", type=pathlib.Path)
    arguments.add_argument("--program", dest="others", type=named, action="append", default=[])
    arguments.add_argument("--compiler", type=named, action="append", default=[])
    arguments.add_argument("--compilers-only", action="store_true")
    given = arguments.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        work = Work(str(given.program.resolve()), given.configs.resolve(), pathlib.Path(scratch))
        return 1 if compare(work, given) else 0


if __name__ == "__main__":
    sys.exit(main())
