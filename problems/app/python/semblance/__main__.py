# SPDX-License-Identifier: GPL-3.0-or-later
"""`python3 -m semblance study`: a study with schemes and metrics in Python."""
import argparse
import pathlib
import sys

from .errors import InputError, IoError
from .experiments import run_study

BAD_INPUT = 2
MOST_LISTED = 20  # failed trials; the report has all


def shard(text):
    index, slash, count = text.partition("/")
    if not (slash and index.isdigit() and count.isdigit() and int(index) < int(count)):
        raise argparse.ArgumentTypeError(f"'{text}' is not I/N with 0 <= I < N")
    return int(index), int(count)


def main(arguments=None):
    parser = argparse.ArgumentParser(prog="python3 -m semblance", description=__doc__)
    commands = parser.add_subparsers(required=True, metavar="study")
    study = commands.add_parser("study", help="run every trial of a study that is not done yet, with its `plugins`")
    study.add_argument("config", metavar="CONFIG", help="YAML file of the study")
    study.add_argument("--out", help="folder for the trials; default: out/NAME")
    study.add_argument("--jobs", type=int, default=1, help="trials at a time")
    study.add_argument("--shard", type=shard, default=(0, 1), metavar="I/N", help="only every N-th trial, starting with trial I (from 0); `semblance merge` collects")
    study.add_argument("--only", default="", help="condition for the trials to run")
    study.add_argument("--rerun", default="", metavar="WHICH", help="run finished trials again: failed, unusable, other-versions or all")
    given = parser.parse_args(arguments)
    out = pathlib.Path("out", pathlib.Path(given.config).stem) if given.out is None else given.out
    try:
        counts = run_study(given.config, out, given.jobs, given.shard, given.only, (), (), rerun=given.rerun)
    except (InputError, IoError) as error:
        print(f"semblance: {error}", file=sys.stderr)
        return BAD_INPUT
    print(counts["ranking"], end="")
    for line in counts["failures"][:MOST_LISTED]:
        print("failed:", line)
    print("{trials} trials, {skipped} existed, {done} done, {failed} failed".format(**counts))
    return 1 if counts["failed"] else 0


if __name__ == "__main__":
    sys.exit(main())
