#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Lines and branches that tests have passed, of all and of what reads files, out of gcovr's JSON.

usage: coverage.py COVERAGE.json READERS     READERS: an expression for the names of files; ends with 1 where they fall short
"""
import json
import re
import sys

LINES, BRANCHES = 0.90, 0.85


class Count:
    def __init__(self):
        self.lines = self.lines_passed = self.branches = self.branches_passed = 0

    def add(self, file):
        for line in file["lines"]:
            if line.get("gcovr/noncode"):
                continue
            self.lines += 1
            self.lines_passed += line["count"] > 0
            for branch in line["branches"]:
                if not branch.get("throw"):
                    self.branches += 1
                    self.branches_passed += branch["count"] > 0

    def shares(self):
        return self.lines_passed / max(1, self.lines), self.branches_passed / max(1, self.branches)

    def tell(self, what):
        lines, branches = self.shares()
        print(f"{what:<56} {self.lines:6d} lines {100 * lines:5.1f} %  {self.branches:6d} branches {100 * branches:5.1f} %")


def main():
    files = json.load(open(sys.argv[1]))["files"]
    sources = [f for f in files if re.match(r"(surfaces|interp|fitting|problems)/", f["file"])]
    readers = [f for f in sources if re.match(sys.argv[2], f["file"])]
    for file in sorted(readers, key=lambda f: f["file"]):
        count = Count()
        count.add(file)
        if count.lines and (count.shares()[0] < LINES or count.shares()[1] < BRANCHES):
            count.tell("  " + file["file"])
    whole, read = Count(), Count()
    for file in sources:
        whole.add(file)
    for file in readers:
        read.add(file)
    whole.tell("all")
    read.tell("what reads files")
    lines, branches = read.shares()
    return 0 if lines >= LINES and branches >= BRANCHES else 1


if __name__ == "__main__":
    sys.exit(main())
