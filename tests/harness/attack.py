#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Hostile calls of every command, and calls whose right result is known: all else is a finding.

usage: attack.py PROGRAM CONFIGS [--cases N] [--laws N] [--seed N] [--only KIND] [--case ID] [--keep FOLDER] [--words FILE] [--good FOLDER]

Cases are drawn from a seed: the same seed, the same cases. Each is called in a folder of its own, beside good files that
it may name (seeds.py). A case is a finding where

    the exit code is not 0, 1 or 2, or the case needs over 20 s of processor, 60 s, or 1 GB
    it was refused (2) and the words name neither the hostile file nor the option, are more than one line where the input
      is no configuration, or are longer than a screen
    nothing says why it could not be used (1)
    it was refused and something was written; or any file that it was given is changed
    it is done (0) and a JSON file that it wrote, or what it printed, holds NaN or infinity
    a control character reaches the terminal

Laws (laws.py) are cases whose right result is known: an input in another form (turned, permuted, in RAS, in copies ...), or an
everyday mistake. Such a case is also a finding where

    a good input in another form is refused, or gives another result without a note
    a mistake gives another result than the plain input, and no word of it

Prints a table by kind, and each finding with what repeats it; ends with 1 if there is one. --case: one alone, with all that
it says; --keep: its folder stays. --words: every different message, to be read by a person. --good: a
folder that keeps the good files for the next call.
"""
import argparse
import concurrent.futures
import dataclasses
import hashlib
import itertools
import json
import math
import os
import pathlib
import re
import resource
import shutil
import subprocess
import sys
import tempfile
import threading
import time

import kinds
import laws
import seeds
import server

CPU_S, WALL_S, MEMORY_KB = 20, 60, 1_000_000
NOBODY = 65534


@dataclasses.dataclass
class Outcome:
    code: int
    out: str
    err: str
    cpu_s: float
    memory_kb: int
    slow: bool


def limits(case):
    resource.setrlimit(resource.RLIMIT_CPU, (CPU_S, CPU_S + 1))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    if case.closed is not None:
        os.close(case.closed)
    if case.as_nobody and os.geteuid() == 0:
        os.setgroups([])
        os.setgid(NOBODY)
        os.setuid(NOBODY)


def call(program, case, folder):
    with open(folder.parent / f"{folder.name}.out", "w+b") as out, open(folder.parent / f"{folder.name}.err", "w+b") as err:
        stdout = open(case.stdout, "wb") if case.stdout else out
        process = subprocess.Popen([program, *case.words], cwd=folder, stdin=subprocess.PIPE, stdout=stdout, stderr=err,
                                   env={**os.environ, **case.env}, preexec_fn=lambda: limits(case))
        late = threading.Timer(WALL_S, process.kill)
        late.start()
        try:
            process.stdin.write(case.stdin)
            process.stdin.close()
        except OSError:
            pass
        _, status, used = os.wait4(process.pid, 0)
        is_late = not late.is_alive()
        late.cancel()
        process.returncode = 0  # it is waited for
        if case.stdout:
            stdout.close()
        text = lambda file: (file.seek(0), file.read().decode("utf-8", "replace"))[1]
        code = os.waitstatus_to_exitcode(status)
        return Outcome(code, text(out), text(err), used.ru_utime + used.ru_stime, used.ru_maxrss, is_late)


# ---------------------------------------------------------------------------------------------- folders


def lay_out(case, folder):
    folder.mkdir(parents=True)
    for name, content in case.files.items():
        path = folder / name if isinstance(name, str) else pathlib.Path(os.fsdecode(os.fsencode(folder) + b"/" + name))
        path.parent.mkdir(parents=True, exist_ok=True)
        if isinstance(content, kinds.Link):
            path.symlink_to(content.target)
        elif isinstance(content, kinds.Folder):
            path.mkdir(exist_ok=True)
        elif isinstance(content, kinds.Copy):
            shutil.copytree(folder.parent / "seeds" / content.of, path, dirs_exist_ok=True)
        else:
            path.write_bytes(content)
    for name, mode in case.modes.items():
        os.chmod(folder / name, mode)
    if case.as_nobody and os.geteuid() == 0:
        os.chown(folder, NOBODY, NOBODY)


def stamps(folder):
    """What lies in a folder: kind, size and time of each name; times of folders change with their content."""
    found = {}
    for root, folders, files in os.walk(folder):
        for name in folders + files:
            path = os.path.join(root, name)
            at = os.lstat(path)
            is_folder = os.path.isdir(path) and not os.path.islink(path)
            found[os.path.relpath(path, folder)] = "folder" if is_folder else (at.st_mode, at.st_size, at.st_mtime_ns, at.st_ino)
    return found


def difference(before, after, outputs):
    """What was changed or lost of what was given, and what is new."""
    is_output = lambda name: any(name == o or name.startswith(o + "/") for o in outputs)
    touched = [n for n in before if after.get(n) != before[n] and not is_output(n)]
    return touched, [n for n in after if n not in before]


# ---------------------------------------------------------------------------------------------- judging


def not_numbers(path):
    """Why a JSON file cannot be read strictly; nothing if it can."""
    def refuse(word):
        raise ValueError(f"{word} in {path.name}")
    try:
        json.loads(path.read_text(), parse_constant=refuse)
    except (ValueError, OSError) as error:
        return str(error)
    return ""


def plain_lines(text):
    asides = ("note:", "warning:", "not kept in this kind of file", "libgomp: ")  # the last of a variable of the user's
    return [line for line in text.splitlines() if line.strip() and not line.startswith(asides)]


def complaints(case, got, folder, before, after):
    """Why the case is a finding, a line each."""
    touched, new = difference(before, after, case.outputs)
    said = got.err + got.out
    if got.code not in (0, 1, 2):
        yield f"exit code {got.code}"
    if got.slow or got.cpu_s > CPU_S:
        yield f"{got.cpu_s:.1f} s of processor, or over {WALL_S} s"
    if got.memory_kb > MEMORY_KB:
        yield f"{got.memory_kb // 1000} MB"
    if touched:
        yield f"changed: {', '.join(touched[:5])}"
    if re.search(r"[\x00-\x08\x0b-\x1f\x7f]", said.replace("\r\n", "\n")) and not case.may_print_anything:
        yield "a control character on the terminal"
    lines = plain_lines(got.err)
    if got.code == 2:
        yield from refusal_complaints(case, got, lines, new)
    if got.code == 1 and not (lines or got.out.strip()) and case.closed is None:
        yield "nothing says why it cannot be used"
    if got.code == 0:
        if re.search(r"(?<![\w.\"'/-])-?(nan|inf)(?![\w/-])", got.out) and not case.may_print_anything:
            yield "nan or inf is printed"
        for name in new:
            why = not_numbers(folder / name) if name.endswith(".json") else ""
            if why:
                yield why
    if case.must_refuse and got.code == 0:
        yield "it is done, and should be refused"


def refusal_complaints(case, got, lines, new):
    if not lines and case.closed is None:
        yield "nothing says why it was refused"
    if len(lines) > case.most_lines or any(len(line) > 1200 for line in lines):
        yield f"{len(lines)} lines, the longest of {max(map(len, lines))} characters"
    if case.names and lines and not any(name in got.err for name in case.names):
        yield f"the words name none of {', '.join(case.names)}"
    if new and not case.may_leave_on_refusal:
        yield f"refused, and left: {', '.join(new[:5])}"
    if re.search(r"terminate called|std::|basic_string|vector::|map::at|stoi|what\(\)|\b0x[0-9a-f]{12}\b|\[json\.exception", got.err):
        yield "words of a library"


# ---------------------------------------------------------------------------------------------- the attack


class Attack:
    def __init__(self, program, root):
        self.program, self.root = program, root
        self.known = stamps(root / "seeds")
        self.words = {}

    def run(self, case, number):
        folder = self.root / f"c{number}"
        lay_out(case, folder)
        before = stamps(folder)
        got = call(self.program, case, folder)
        found = list(complaints(case, got, folder, before, stamps(folder)))
        verdict, fault = laws.verdict(case, got, folder) if case.law else ("", "")
        if fault:
            found.append(fault)
        if stamps(self.root / "seeds") != self.known:
            found.append("a good file beside it is changed")
        for name, mode in case.modes.items():
            os.chmod(folder / name, 0o700)
        for ending in (".out", ".err"):
            (self.root / (folder.name + ending)).unlink()
        return case, got, found, folder, verdict

    def remember(self, case, got):
        for line in plain_lines(got.err)[:3]:
            shape = re.sub(r"\d+", "0", line)
            self.words.setdefault(shape, (case, line))


def in_batches(pool, run, cases):
    """Results in the order of the cases. Few cases are held at a time, because a child counts our memory as its own before it starts."""
    numbers, cases = itertools.count(), iter(cases)
    while batch := list(itertools.islice(cases, 32)):
        yield from pool.map(run, batch, itertools.islice(numbers, len(batch)))


VERDICTS = ["right", "noted", "unusable", "refused", "silent"]


def print_verdicts(verdicts, findings):
    """Cases whose right result is known: accepted and right, accepted with a note, not usable, refused, wrong without a word."""
    if not verdicts:
        return
    print(f"\n{'right result known':<22} {'cases':>6} " + " ".join(f"{v:>9}" for v in VERDICTS) + f" {'findings':>9} {'s per case':>11}")
    for kind, row in verdicts.items():
        count = sum(row[v] for v in VERDICTS)
        print(f"{kind:<22} {count:6d} " + " ".join(f"{row[v]:9d}" for v in VERDICTS) + f" {findings.count(kind):9d} {row['cpu_s'] / count:11.2f}")


def told(case, got, found, again):
    words = " ".join(map(repr, case.words))
    return f"\n{case.kind} {case.id}: {case.what[:200]}\n  again: {again} --case {case.id}\n  semblance {words[:600]}\n  code {got.code}, {got.cpu_s:.2f} s: {got.err.strip()[:600]}\n" + "".join(
        f"  FINDING: {line}\n" for line in found)


def main():
    arguments = argparse.ArgumentParser()
    arguments.add_argument("program", type=pathlib.Path)
    arguments.add_argument("configs", type=pathlib.Path)
    arguments.add_argument("--cases", type=int, default=2000)
    arguments.add_argument("--laws", type=int, default=1000)
    arguments.add_argument("--seed", type=int, default=1)
    arguments.add_argument("--jobs", type=int, default=1)
    arguments.add_argument("--only")
    arguments.add_argument("--case")
    arguments.add_argument("--keep", type=pathlib.Path)
    arguments.add_argument("--words", type=pathlib.Path)
    arguments.add_argument("--good", type=pathlib.Path)
    given = arguments.parse_args()
    start = time.monotonic()
    program, configs = given.program.resolve(), given.configs.resolve()
    again = f"{sys.argv[0]} {given.program} {given.configs} --cases {given.cases} --laws {given.laws} --seed {given.seed}"
    with tempfile.TemporaryDirectory(prefix="attack") as scratch:
        root = pathlib.Path(scratch)
        os.chmod(root, 0o755)
        if given.good and given.good.exists():
            shutil.copytree(given.good, root / "seeds", symlinks=True)
        else:
            (root / "seeds").mkdir()
            if given.cases:
                seeds.make(program, configs, root / "seeds")
        if given.good and not given.good.exists():
            shutil.copytree(root / "seeds", given.good, symlinks=True)
        world = laws.World(str(program), configs, root / "seeds", given.seed) if given.laws else None
        cases = kinds.cases(str(program), root / "seeds", given.seed, given.cases) if given.cases else []
        cases = itertools.chain(cases, laws.cases(world, given.laws) if world else [])
        cases = (c for c in cases if given.only in (None, c.kind) and given.case in (None, c.id))
        attack = Attack(str(program), root)
        ready_s = time.monotonic() - start
        table, findings, verdicts = {}, [], {}
        with concurrent.futures.ThreadPoolExecutor(given.jobs) as pool:
            for case, got, found, folder, verdict in in_batches(pool, attack.run, cases):
                if verdict:
                    row = verdicts.setdefault(case.kind, {**dict.fromkeys(VERDICTS, 0), "cpu_s": 0.0})
                    row[verdict] += 1
                    row["cpu_s"] += got.cpu_s
                row = table.setdefault(case.kind, [0, 0, 0, 0, 0, 0.0])
                row[0] += 1
                row[1 + min(3, got.code if got.code in (0, 1, 2) else 3)] += 1
                row[5] += got.cpu_s
                attack.remember(case, got)
                if found:
                    findings.append(case.kind)
                    print(told(case, got, found, again), flush=True)
                if given.case:
                    print(got.out + got.err)
                if given.case and given.keep:
                    shutil.copytree(folder, given.keep, symlinks=True)
                shutil.rmtree(folder)
        if given.cases and given.case is None and given.only in (None, "workbench"):
            served, answers, faults = server.attack(str(program), root, given.seed)
            table["workbench"] = [served, *answers, 0.0]
            findings += ["workbench"] * len(faults)
            for fault in faults:
                print(f"\nworkbench: {fault}", flush=True)
    print(f"{'kind':<22} {'cases':>6} {'done':>6} {'unusable':>9} {'refused':>8} {'findings':>9} {'processor s':>12}")
    for kind, row in table.items():
        print(f"{kind:<22} {row[0]:6d} {row[1]:6d} {row[2]:9d} {row[3]:8d} {findings.count(kind):9d} {row[5]:12.1f}")
    total = [sum(row[k] for row in table.values()) for k in range(6)]
    print(f"{'all':<22} {total[0]:6d} {total[1]:6d} {total[2]:9d} {total[3]:8d} {len(findings):9d} {total[5]:12.1f}")
    print_verdicts(verdicts, findings)
    print(f"seed {given.seed}; {time.monotonic() - start:.0f} s, of them {ready_s:.0f} s for the good files")
    if given.words:
        given.words.write_text("".join(f"{case.kind} {case.id} | {line}\n" for _, (case, line) in sorted(attack.words.items())))
    return 1 if findings else 0


if __name__ == "__main__":
    sys.exit(main())
