#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Names that would be tags, scripts, SQL or orders to the terminal, where trials succeed.

usage: hostile_names.py PROGRAM CONFIGS

Pages are made twice, once with plain names and once with hostile ones in titles, subjects, tags, sites and axes. Both
must have the same tags and attributes in the same order, no value of a name outside of texts, and so no script of its
own; the tables of SQLite must hold the names as they are; nothing on the terminal may be a control character.
"""
import html.parser
import json
import pathlib
import re
import sqlite3
import subprocess
import sys
import tempfile

HOSTILE = {
    "title": "</title></script><script>window.x=1</script><img src=x onerror=window.x=1>",
    "subject": "\"><svg onload=window.x=1> '); DROP TABLE trials; --",
    "other": "a' onmouseover='window.x=1",
    "tag": "<b onclick=window.x=1>",
    "axis": "</td></tr></table><script>window.x=1</script>",
    "cell": "]]><!--\u001b[31m\u0007",
}
PLAIN = {"title": "title", "subject": "subject one", "other": "subject two", "tag": "tag", "axis": "plain", "cell": "cell"}


class Tags(html.parser.HTMLParser):
    """The tags of a page, with the names of their attributes but for classes, which follow from the values."""

    def __init__(self, text):
        super().__init__()
        self.tags, self.handlers = [], []
        self.feed(text)
        self.close()

    def handle_starttag(self, tag, attrs):
        self.tags.append((tag, tuple(sorted(name for name, _ in attrs if name != "class"))))
        self.handlers += [f"{tag} {name}" for name, value in attrs if name.startswith("on") and "window.x" in (value or "")]

    def handle_endtag(self, tag):
        self.tags.append(("/" + tag,))


def call(program, folder, *words):
    done = subprocess.run([program, *words], cwd=folder, capture_output=True, text=True, errors="replace")
    if done.returncode not in (0, 1):
        sys.exit(f"{words}: exit code {done.returncode}: {done.stderr}")
    return done.stdout + done.stderr


def quoted(text):
    return json.dumps(text)


def make(program, configs, folder, names):
    """All pages in a folder, and what was said on the terminal."""
    study = folder / "study.yaml"
    study.write_text(f"""title: {quoted(names['title'])}
base: {configs}/phantom.yaml
job: depth
keep: view
set: {{subject.rings: 16}}
tags: [{quoted(names['tag'])}]
subjects:
  - {{name: {quoted(names['subject'])}, set: {{subject.random_seed: 1}}}}
  - {{name: {quoted(names['other'])}, set: {{subject.random_seed: 2}}}}
zip: {{interp: [nearest, mean], title: [{quoted(names['axis'])}, {quoted(names['cell'])}]}}
metric: depth_truth.along_direction.rms_mm
""")
    said = call(program, folder, "study", "study.yaml", "--out", "study")
    said += call(program, folder, "status", "study")
    call(program, folder, "study", "study.yaml", "--out", "again", "--quiet")
    said += call(program, folder, "compare", "study", "again", "--out", "compare")
    fit = folder / "fit.yaml"
    fit.write_text(f"title: {quoted(names['title'])}\npatches_u: 2\npatches_v: 2\nparameters: given\nfit: {{plan: {{type: auto, finest: 1}}}}\n")
    said += call(program, folder, "fit", str(configs / "fit/points.csv"), "fit.yaml", "--out", "fit", "--quiet")
    return said


def main():
    program, configs = str(pathlib.Path(sys.argv[1]).resolve()), pathlib.Path(sys.argv[2]).resolve()
    faults = []
    with tempfile.TemporaryDirectory() as top:
        plain, hostile = pathlib.Path(top) / "plain", pathlib.Path(top) / "hostile"
        for folder, names in ((plain, PLAIN), (hostile, HOSTILE)):
            folder.mkdir()
            said = make(program, configs, folder, names)
            faults += [f"control character {c!r} on the terminal" for c in set(re.findall(r"[\x00-\x08\x0b-\x1f\x7f]", said))]
        pages = sorted(p.relative_to(plain) for p in plain.rglob("*.html"))
        if len(pages) < 3:
            faults.append(f"only {len(pages)} pages: {pages}")
        for page in pages:
            a, b = Tags((plain / page).read_text()), Tags((hostile / page).read_text())
            if a.tags != b.tags:
                n = next((k for k, (x, y) in enumerate(zip(a.tags, b.tags)) if x != y), min(len(a.tags), len(b.tags)))
                faults.append(f"{page}: tag {n} is {b.tags[n:n + 3]} where plain names give {a.tags[n:n + 3]}")
            faults += [f"{page}: a handler: {h}" for h in b.handlers]
        rows = sqlite3.connect(hostile / "study/results.sqlite")
        known = {str(v) for (table,) in rows.execute("select name from sqlite_master where type = 'table'").fetchall()
                 for row in rows.execute(f'select * from "{table}"') for v in row}
        for name in ("subject", "other", "axis"):
            if not any(HOSTILE[name] in v for v in known):
                faults.append(f"results.sqlite does not hold the {name} {HOSTILE[name]!r}")
        print(f"{len(pages)} pages: {', '.join(map(str, pages))}; {len(faults)} faults")
    print("\n".join(faults))
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
