#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Which sockets the program opens, as strace sees it: none but the workbench's, and that on loopback alone.

usage: sockets.py PROGRAM CONFIGS     77: skipped, as strace is not here or may not trace

A socket of the machine itself (AF_UNIX) is let pass: the C library asks the name service for the user's name.
"""
import os
import pathlib
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import urllib.request

import seeds

TRACE = ["strace", "-f", "-qq", "--seccomp-bpf", "-e", "trace=network", "-o"]
FACE = "run/face.hspline.json"
# Each command, with the exit codes that these words may have.
CALLS = [
    (0, "phantom --head smooth --out phantom --pixel-mm 5 --slice-mm 10"), (0, "import-ct phantom/ct --out import --quiet"), (0, "run experiment.yaml --out run --quiet"),
    (0, "depth experiment.yaml --out depth --quiet"), (0, "report run"), (0, "fit points.csv fit.yaml --out fit --quiet"), (0, "check experiment.yaml fit.yaml study.yaml"),
    (0, "options fit"), (0, "evaluate import/skin.ply phantom/true_skin.ply --quiet"), (0, "study study.yaml --out study --quiet"), (0, "status study"),
    (0, "merge merged study"), (0, "compare study merged"), (0, f"edit {FACE} edits.yaml --out edited.json"), (0, f"export {FACE} --to face.step"),
    (0, f"feature extract {FACE} --name nose --library library --u 0.2 0.6 --v 0.2 0.6"), (0, "feature list library"), (0, "template experiment.yaml --out template"),
    (0, "landmarks convert phantom/landmarks.yaml landmarks.csv"), (0, "landmarks page t_table_2023.yaml --out page"), (2, "landmarks propose ball.csv --out sites.yaml"),
    (2, "recentre experiment.yaml --out recentred --set template=nosuch"), (0, "completion bash"), (0, "manual"), (2, "submit nosuch.yaml --slurm"),
    (2, "prior ball.ply points.npy --sites landmarks.csv --features landmarks.csv --template template --out modes.json"),
]


def foreign(trace):
    """The calls of a trace that concern any net."""
    return [line for line in trace.read_text(errors="replace").splitlines() if re.search(r"AF_(?!UNIX|UNSPEC)|PF_(?!UNIX)", line)]


def traced(program, folder, allowed, words):
    trace = folder / "calls.txt"
    done = subprocess.run([*TRACE, trace, program, *words.split()], cwd=folder, capture_output=True, text=True, errors="replace", stdin=subprocess.DEVNULL)
    if done.returncode != allowed:
        return [f"{words}: exit code {done.returncode}: {done.stderr.strip()[:300]}"]
    return [f"{words}: {line}" for line in foreign(trace)]


def traced_workbench(program, folder):
    trace = folder / "workbench.txt"
    process = subprocess.Popen([*TRACE, trace, program, "workbench", "--out", "bench"], cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    found = None
    for line in process.stdout:
        if found := re.search(r"http://127\.0\.0\.1:(\d+)/\w+/", line):
            break
    urllib.request.urlopen(found.group(0), timeout=20).read()
    port = f"{int(found.group(1)):04X}"
    listening = [row.split()[1] for file in ("tcp", "tcp6") if os.path.exists(f"/proc/net/{file}")
                 for row in open(f"/proc/net/{file}") if row.split()[1].endswith(":" + port) and row.split()[3] == "0A"]
    child = int(open(f"/proc/{process.pid}/task/{process.pid}/children").read().split()[0])
    os.kill(child, signal.SIGTERM)
    process.communicate(timeout=30)
    faults = [] if listening == ["0100007F:" + port] else [f"workbench listens on {listening}"]
    calls = foreign(trace)
    bound = [line for line in calls if "bind(" in line]
    if not bound:
        faults.append("workbench: strace saw no bind, so it sees nothing")
    for line in calls:
        if "connect(" in line or ("bind(" in line and 'inet_addr("127.0.0.1")' not in line):
            faults.append(f"workbench: {line}")
    return faults


def main():
    program, configs = pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2]).resolve()
    if shutil.which("strace") is None or subprocess.run([*TRACE, "/dev/null", "true"], capture_output=True).returncode != 0:
        print("skipped: strace is not here, or may not trace")
        return 77
    with tempfile.TemporaryDirectory() as scratch:
        folder = pathlib.Path(scratch)
        maker = seeds.Maker(program, configs, folder)
        for name, data in {**seeds.meshes(), **seeds.points()}.items():
            maker.write(name, data)
        maker.texts()
        start = time.monotonic()
        faults = [fault for allowed, words in CALLS for fault in traced(program, folder, allowed, words)]
        faults += traced_workbench(program, folder)
    print("".join(fault + "\n" for fault in faults) + f"{len(CALLS) + 1} commands, {len(faults)} faults, {time.monotonic() - start:.0f} s")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
