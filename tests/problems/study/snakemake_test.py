#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""docs/examples/Snakefile runs a study in shards, and the tables are those of one process.

usage: snakemake_test.py PROGRAM SOURCE; ends with 77 if snakemake is not installed.
"""
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile

STUDY = """
base: {source}/configs/phantom.yaml
job: depth
set: {{subject.rings: 24}}
grid: {{interp: [nearest, mean, kriging, harmonic, barycentric]}}
metric: depth_truth.along_direction.rms_mm
"""


def main():
    program, source = pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2]).resolve()
    if shutil.which("snakemake") is None:
        print("skipped: snakemake is not installed")
        sys.exit(77)
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        (folder / "bin").mkdir()
        (folder / "bin/semblance").symlink_to(program)
        (folder / "study.yaml").write_text(STUDY.format(source=source))
        environment = {**os.environ, "PATH": f"{folder / 'bin'}:{os.environ['PATH']}", "HOME": name, "XDG_CACHE_HOME": name}
        subprocess.run(["snakemake", "-s", source / "docs/examples/Snakefile", "--cores", "2", "--quiet",
                        "--config", "study=study.yaml", "shards=3", "out=out"], cwd=folder, env=environment, check=True)
        subprocess.run([program, "study", "study.yaml", "--out", "one", "--quiet"], cwd=folder, check=True)
        shards = [len(list((folder / f"out/shard{i}/trials").iterdir())) for i in range(3)]
        assert sorted(shards) == [1, 2, 2], shards
        for table in ("trials.csv", "trials_wide.csv", "summary.csv", "results.sqlite"):
            assert (folder / "out/merged" / table).read_bytes() == (folder / "one" / table).read_bytes(), table


main()
