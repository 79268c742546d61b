# SPDX-License-Identifier: GPL-3.0-or-later
"""Hostile requests to one workbench: each is answered, refused ones change nothing, and it ends well when it is told to."""
import http.client
import json
import random
import re
import signal
import subprocess
import time
import urllib.parse

import mutations

REQUESTS = 260
ACTIONS = [
    {"do": "place", "site": "g", "origin": [0, -300, 0], "direction": [0, 1, 0], "near": [0, -90, 0]}, {"do": "remove", "site": "g"},
    {"do": "rename", "site": "g", "name": "n"}, {"do": "absent", "site": "g", "reason": "x"}, {"do": "confirm", "site": "g"}, {"do": "confirm_all"}, {"do": "leave_out_doubtful"},
    {"do": "remark", "site": "g", "certainty": "low", "note": "x", "depth_mm": 5}, {"do": "set", "path": "tissue.set_mm.g", "value": 5},
    {"do": "set", "path": "interp", "value": "nearest"}, {"do": "unset", "path": "interp"}, {"do": "pull", "at": [0, -90, 0], "by": [0, -1, 0], "level": 1, "reach": 1.0, "mirror": False},
    {"do": "clear_edits"}, {"do": "keep_feature", "part": "nose", "name": "a"}, {"do": "blend_feature", "name": "a", "weight": 0.5}, {"do": "undo"}, {"do": "redo"},
    {"do": "cancel"}, {"do": "clear_landmarks"},
]
PLACES = ["", "index.html", "main.js", "run/report.html", "run/../workbench.yaml", "run/%2e%2e/workbench.yaml", "run//etc/passwd", "run/\0", "../../etc/passwd", "api/state",
          "api/nosuch", "api/coarse?variant=%00", "api/coarse?variant=thinner", "api/coarse?path=interp&value=nearest", "api/coarse?path=interp&value=[", "api/coarse?path=%ff&value=1",
          "api/coarse?path=subject.skull&value=/dev/zero", "api/coarse?path=" + "a." * 5000 + "&value=1", "api/landmarks?format=.pp", "api/landmarks?format=/../x", "api/landmarks?format=",
          "api/landmarks?format=%0d%0aSet-Cookie:x.csv", "api/export?format=.step", "api/export?format=.exe", "api/files", "api/meshes", "api/sites", "x" * 9000, "%", "%zz", "api/state?a=b&a=c"]


class Bench:
    def __init__(self, program, folder):
        self.process = subprocess.Popen([program, "workbench", "seeds/head.yaml", "--out", "bench", "--threads", "1"], cwd=folder, stdout=subprocess.PIPE,
                                        stderr=subprocess.PIPE, text=True, errors="replace")
        for line in self.process.stdout:
            if found := re.search(r"http://127\.0\.0\.1:(\d+)(/\w+/)", line):
                self.port, self.token = int(found.group(1)), found.group(2)
                return
        raise RuntimeError(self.process.stderr.read())

    def ask(self, method, path, body=b"", headers=(), kind="application/json"):
        """status, body; None where there is no answer"""
        link = http.client.HTTPConnection("127.0.0.1", self.port, timeout=30)
        try:
            link.putrequest(method, path, skip_host=True)
            given = {"Host": f"127.0.0.1:{self.port}", "Origin": f"http://127.0.0.1:{self.port}", "Content-Type": kind, "Content-Length": str(len(body)), **dict(headers)}
            for name, value in given.items():
                if value is not None:
                    link.putheader(name, value)
            link.endheaders(body)
            answer = link.getresponse()
            return answer.status, answer.read()
        except (OSError, http.client.HTTPException, ValueError):
            return None
        finally:
            link.close()

    def state(self):
        answer = self.ask("GET", self.token + "api/state")
        return json.loads(answer[1]) if answer else None

    def end(self):
        self.process.send_signal(signal.SIGTERM)
        out, err = self.process.communicate(timeout=30)
        return self.process.returncode, err


def request(bench, folder, draw):
    """what it is, method, path, body, headers, type"""
    kind = draw.choice(["act", "act", "act", "act", "upload", "upload", "open", "place", "head", "head"])
    if kind == "act":
        good = json.dumps(draw.choice(ACTIONS)).encode()
        what, body = mutations.json_text(good, draw) if draw.random() < 0.9 else ("good", good)
        return f"act {good[:40]!r}: {what}", "POST", "api/act", body, {}, "application/json"
    if kind == "upload":
        good = draw.choice(["ball.ply", "ball.stl", "landmarks.csv", "landmarks.mrk.json", "phantom/landmarks.yaml"])
        what, body = mutations.text((folder / "seeds" / good).read_bytes(), draw)
        name = draw.choice([good.rsplit("/", 1)[-1]] * 4 + ["../x.ply", "", ".x", "a" * 200 + ".ply", "a b.ply", "\0.ply", "x", "workbench.yaml"])
        to = draw.choice(["skull", "skin", "landmarks", "nosuch", ""])
        return f"upload {name[:20]!r} as {to}: {what}", "POST", "api/upload?" + urllib.parse.urlencode({"as": to, "name": name}), body, {}, "application/octet-stream"
    if kind == "open":
        path = draw.choice(["/dev/null", "/dev/zero", "/", "", "nosuch", "seeds/ball.ply", "seeds/landmarks.csv", "seeds/head.nii", "x" * 5000, "\0", "seeds/ball.ply/x", "\u202e"])
        return f"open {path[:20]!r}", "POST", "api/open", json.dumps({"as": draw.choice(["skull", "skin", "landmarks", "x"]), "path": path}).encode(), {}, "application/json"
    if kind == "place":
        return "place", draw.choice(["GET", "GET", "POST", "PUT", "DELETE", "HEAD", "OPTIONS", "BREW"]), draw.choice(PLACES), b"", {}, "application/json"
    header = draw.choice([{"Host": "evil.example"}, {"Host": None}, {"Origin": None}, {"Origin": "null"}, {"Origin": "http://evil.example"}, {"Content-Length": "99999999999999999999"},
                          {"Content-Length": "-1"}, {"Content-Length": None}, {"Content-Type": "text/plain"}, {"Content-Type": None}, {"Transfer-Encoding": "chunked"}, {"Cookie": "x" * 5000},
                          {"X": "y" * 60000}, {"Range": "bytes=-1-,5-2"}, {"Expect": "100-continue"}, {"Connection": "Upgrade", "Upgrade": "h2c"}, {"Accept-Encoding": "gzip;q=nan"}])
    return f"head {str(header)[:60]}", draw.choice(["POST", "GET"]), draw.choice(["api/act", "api/state", "api/upload?as=skull&name=a.ply"]), b'{"do": "undo"}', header, "application/json"


def is_refusal(body):
    return body.startswith(b'{"refused":')


def faults_of(what, answer, before, after, method):
    if answer is None:
        if "head" not in what and "place" not in what:
            yield "no answer"
        return
    status, body = answer
    refused = status >= 400 or is_refusal(body)
    if status >= 500 or not 200 <= status:
        yield f"status {status}: {body[:200]!r}"
    if refused and method == "POST" and before["revision"] != after["revision"]:
        yield f"refused with {status}, and the state has changed"
    if refused and body and len(body) > 4000:
        yield f"{len(body)} bytes of refusal"


def attack(program, folder, seed):
    """how many requests, [done, 0, refused, no answer], the faults"""
    draw, faults, counts = random.Random(f"{seed} workbench"), [], [0, 0, 0, 0]
    bench = Bench(program, folder)
    for number in range(REQUESTS):
        before = bench.state()
        what, method, path, body, headers, kind = request(bench, folder, draw)
        path = urllib.parse.quote(path, safe="/?&=%:.-_[],", errors="surrogateescape")
        start = time.monotonic()
        answer = bench.ask(method, bench.token + path, body, headers, kind)
        took_s = time.monotonic() - start
        after = bench.state()
        if after is None:
            faults.append(f"after request {number} ({what}) it answers no more: {bench.process.poll()}")
            bench = Bench(program, folder)
            continue
        found = list(faults_of(what, answer, before, after, method)) + ([f"{took_s:.1f} s"] if took_s > 15 else [])
        faults += [f"request {number}, {what}: {method} {path[:100]}: {fault}" for fault in found]
        counts[3 if answer is None else 0 if answer[0] < 400 and not is_refusal(answer[1]) else 2] += 1
    code, err = bench.end()
    if code != 0 or err.strip():
        faults.append(f"ended with {code}: {err[:300]}")
    return REQUESTS, counts, faults
