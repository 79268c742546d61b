# SPDX-License-Identifier: GPL-3.0-or-later
"""Kills a workbench at random moments while actions are posted, and looks whether what it had said to be done is there
when the folder is opened again.

usage: workbench_kills.py PROGRAM CONFIG COUNT SEED     prints how many kills fell short
"""
import http.client
import json
import os
import random
import re
import subprocess
import sys
import tempfile
import threading
import time
import urllib.request


def start(program, arguments):
    process = subprocess.Popen([program, "workbench", *arguments], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    for line in process.stdout:
        if found := re.search(r"http://(127\.0\.0\.1:\d+)/\w+/", line):
            return process, found.group(0), found.group(1)
    raise RuntimeError(process.stderr.read())


def ask(url, host, body=None):
    data = json.dumps(body).encode() if body else None
    request = urllib.request.Request(url, data, {"Content-Type": "application/json", "Origin": f"http://{host}"})
    with urllib.request.urlopen(request, timeout=20) as reply:
        return json.load(reply)


def depth_in(state):
    return state["values"]["tissue"]["set_mm"].get("g")


def work_until_killed(process, url, host, first, after_s):
    """Sets one depth after the other; the last that was acknowledged."""
    done = [None]

    def post():
        for step in range(1000):
            try:
                answer = ask(url + "api/act", host, {"do": "set", "path": "tissue.set_mm.g", "value": first + step / 1000})
            except (OSError, ValueError, http.client.HTTPException):  # an answer that the kill cut off was not given
                return
            done[0] = depth_in(answer)

    worker = threading.Thread(target=post)
    worker.start()
    time.sleep(after_s)
    process.kill()
    process.wait()
    worker.join()
    return done[0]


def main():
    program, config, count, seed = sys.argv[1], sys.argv[2], int(sys.argv[3]), sys.argv[4]
    chance, short = random.Random(seed), 0
    with tempfile.TemporaryDirectory() as scratch:
        folder = os.path.join(scratch, "bench")
        process, url, host = start(program, [config, "--out", folder])
        known = None
        for kill in range(count):
            done = work_until_killed(process, url, host, 2.0 + kill, chance.uniform(0.0, 0.3))
            known = known if done is None else done
            try:
                process, url, host = start(program, [folder])
                found = depth_in(ask(url + "api/state", host))
            except (RuntimeError, OSError, ValueError) as error:
                print(f"after kill {kill}: {error}", file=sys.stderr)
                print(count - kill + short)
                return
            # The last one that was acknowledged, or the one that was being written.
            in_flight = 2.0 + kill if done is None else done + 0.001
            if found != known and (found is None or abs(found - in_flight) > 1e-9):
                print(f"after kill {kill}: {found}, not {known}", file=sys.stderr)
                short += 1
            known = found
        process.kill()
        process.wait()
    print(short)


if __name__ == "__main__":
    main()
