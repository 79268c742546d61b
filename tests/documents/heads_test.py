#!/usr/bin/python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""`make heads`: a phantom in the layout of a head gives the numbers of its own run, and the table goes into a page.

usage: heads_test.py PROGRAM SOURCE
"""
import json
import pathlib
import shutil
import subprocess
import sys
import tempfile

PAGE = "before\n<!-- heads -->\nold\n<!-- end of heads -->\nafter\n"


def call(*words, code=0):
    done = subprocess.run([str(word) for word in words], capture_output=True, text=True, check=False)
    assert done.returncode == code, (words, done.returncode, done.stderr)
    return done


def make_head(program, folder, head):
    call(program, "phantom", "--head", "smooth", "--out", folder / "phantom", "--pixel-mm", 3, "--slice-mm", 3)
    call(program, "import-ct", folder / "phantom/ct", "--out", folder / "import", "--quiet")
    head.mkdir(parents=True)
    for name, source in (("skull.ply", "import/skull.ply"), ("skin.ply", "import/skin.ply"), ("landmarks.yaml", "phantom/landmarks.yaml")):
        shutil.copy(folder / source, head / name)
    lines = (head / "landmarks.yaml").read_text().splitlines(keepends=True)
    (head / "landmarks.yaml").write_text("".join(line for line in lines if "depth_" not in line))  # a folder need not state depths


def main():
    program, source = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2])
    heads = [sys.executable, source / "docs/heads.py", program]
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        (folder / "heads/not_a_head").mkdir(parents=True)
        refused = call(*heads, folder / "heads", folder / "out", code=1)
        assert "no folder in it has skull.ply" in refused.stderr, refused.stderr
        make_head(program, folder, folder / "heads/mine")
        (folder / "page.md").write_text(PAGE)
        call(*heads, folder / "heads", folder / "out", "--only", "measured", "--page", folder / "page.md")
        table = (folder / "out/heads.md").read_text()
        lines = [[cell.strip() for cell in line.split("|")[1:-1]] for line in table.splitlines()]
        assert [line[:2] for line in lines[2:]] == [["mine", "measured"]], table
        assert len({len(line) for line in lines}) == 1, table
        assert (folder / "page.md").read_text() == PAGE.replace("old", "\n" + table)
        assert (folder / "out/mine-overview.png").read_bytes()[:4] == b"\x89PNG"
        (trial,) = (folder / "out/study/trials").iterdir()
        face = json.loads((trial / "trial.json").read_text())["result"]["face"]
        line, nose = lines[2], face["regions"]["nose"]
        assert line[2:5] == [f"{face['mean_abs_mm']:.2f}", f"{face['mean_signed_mm']:.2f}", f"{100 * face['within_2_5mm']:.0f} %"], (line, face)
        assert line[lines[0].index("nose")] == f"{nose['mean_abs_mm']:.2f} ({nose['mean_signed_mm']:+.1f})", line


main()
