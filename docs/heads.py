#!/usr/bin/python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Recovers every head of a folder that has a true skin, and writes one table and pictures: heads.py PROGRAM FOLDER OUT
[--only PATTERN] [--page FILE].

A head is a folder with skull.ply, skin.ply (one frame, mm, LPS) and landmarks in any format that the program reads
(landmarks.*). configs/heads/NAME.yaml, if it exists, adds what is known of a head: its own landmarks, the zones that are
not scored. Each head is recovered with the depths that are measured on its skin, and with those of two tables for three builds.
OUT gets the study, heads.md with the table, and pictures of the heads with measured depths. An interrupted call goes on where
it ended. --only chooses the depths whose titles match a regular expression. --page also puts the table between the lines
<!-- heads --> and <!-- end of heads --> of a page."""
import argparse
import csv
import json
import re
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
TABLES = ROOT / "configs/tables"
BUILDS = {"lean": -1, "average": 0, "heavy": 1}  # standard deviations of build
PARTS = ["forehead", "temples", "orbits", "nose", "cheeks", "mouth", "chin", "jaw"]
MEASURED, NETWORK = "measured", "measured, scored in front of the markers"
TREATMENTS = [
    {"title": MEASURED},
    {"title": NETWORK, "region.extent": "network"},
    *({"title": f"54 people, {word}", "tissue.depths": "table", "tissue.table": str(TABLES / "open_kbp.yaml"), "tissue.given.build_sds": sds}
      for word, sds in BUILDS.items()),
    *({"title": f"T-Table, {word}", "tissue.depths": "table", "tissue.table": str(TABLES / "t_table_2023.yaml"),
       "tissue.fill_from": str(TABLES / "rhine_caucasoid.yaml"), "tissue.sds": sds} for word, sds in BUILDS.items()),
]


# What is assumed of a head that configs/heads does not know.
ANY = {"title": "A head with a true skin", "subject": {"type": "files"}, "tissue": {"depths": "skin"}, "network": str(ROOT / "configs/networks/standard32.yaml")}


def heads_in(folder, base):
    """The subjects of the study: a name, a base, and the files of the folder."""
    for head in sorted(folder.iterdir()):
        skull, skin = head / "skull.ply", head / "skin.ply"
        landmarks = sorted(head.glob("landmarks.*"))
        if not (skull.exists() and skin.exists() and landmarks):
            continue
        known = ROOT / "configs/heads" / f"{head.name}.yaml"
        subject = {"subject.skull": str(skull), "subject.skin": str(skin)}
        if not known.exists():
            subject["subject.landmarks"] = str(landmarks[0])
        yield {"name": head.name, "base": str(known if known.exists() else base), "set": subject}


def run_study(program, folder, out, only):
    out.mkdir(parents=True, exist_ok=True)
    (out / "any.yaml").write_text(json.dumps(ANY))  # JSON is YAML
    subjects = list(heads_in(folder, out / "any.yaml"))
    if not subjects:
        sys.exit(f"heads.py: {folder}: no folder in it has skull.ply, skin.ply and landmarks.*; give the folder of the heads")
    study = {"title": "Heads with a true skin", "base": subjects[0]["base"], "subjects": subjects, "list": [t for t in TREATMENTS if re.fullmatch(only, t["title"])], "set": {"bust": "none"},
             "metric": "face.mean_abs_mm", "keep": "run"}
    (out / "heads.yaml").write_text(json.dumps(study, indent=1, ensure_ascii=False))
    done = subprocess.run([program, "study", out / "heads.yaml", "--out", out / "study", "--quiet"], stdout=subprocess.DEVNULL, check=False)
    if done.returncode > 1:
        sys.exit(done.returncode)
    with open(out / "study/trials_wide.csv", newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def number(row, metric, digits=2):
    text = row.get(metric, "")
    return f"{float(text):.{digits}f}" if text else ""


def table_of(rows):
    """One line per trial: the whole face, then its parts, as mean distance and signed mean in mm."""
    yield "| head | depths | mean, mm | signed | within 2.5 mm | p95 | 90 % interval holds | " + " | ".join(PARTS) + " | usable |"
    yield "|---|---|" + "--:|" * (5 + len(PARTS)) + "---|"
    for row in rows:
        share = [f"{100 * float(row[key]):.0f} %" if row.get(key) else "" for key in ("face.within_2_5mm", "uncertainty.coverage_90")]
        parts = [" ".join(filter(None, (number(row, f"face.regions.{part}.mean_abs_mm"), signed and f"({float(signed):+.1f})")))
                 for part in PARTS for signed in [row.get(f"face.regions.{part}.mean_signed_mm", "")]]
        cells = [row["subject"], row["title"], number(row, "face.mean_abs_mm"), number(row, "face.mean_signed_mm"), share[0],
                 number(row, "face.p95_mm", 1), share[1], *parts, {"done": "yes", "unusable": "no"}.get(row["status"], row["status"])]
        yield "| " + " | ".join(cells) + " |"


def keep_pictures(rows, out):
    for row in rows:
        if row["title"] == MEASURED and (out / "study/trials" / row["trial"] / "pictures").exists():
            for name in ("overview", "error", "face"):
                picture = out / "study/trials" / row["trial"] / "pictures" / f"{name}.png"
                if picture.exists():
                    shutil.copy(picture, out / f"{row['subject']}-{name}.png")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", type=Path)
    parser.add_argument("folder", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--only", default=".*")
    parser.add_argument("--page", type=Path)
    a = parser.parse_args()
    rows = run_study(a.program.resolve(), a.folder.resolve(), a.out.resolve(), a.only)
    table = "\n".join(table_of(rows))
    (a.out / "heads.md").write_text(table + "\n", encoding="utf-8")
    keep_pictures(rows, a.out)
    if a.page:
        page = a.page.read_text(encoding="utf-8")
        new = re.sub("(<!-- heads -->\n).*?(<!-- end of heads -->)", lambda m: f"{m[1]}\n{table}\n\n{m[2]}", page, flags=re.S)
        if new == page and table not in page:
            sys.exit(f"heads.py: {a.page}: the lines <!-- heads --> and <!-- end of heads --> are not there; add them")
        a.page.write_text(new, encoding="utf-8")
    print(table)


main()
