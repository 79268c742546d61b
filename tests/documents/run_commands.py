#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs the documents' commands as they are written there.

usage: run_commands.py PROGRAM SOURCE DOCUMENT...

A document marks a block (indented by four blanks) with a comment on the line before it:

    <!-- run -->          its commands run in order, and each must end with 0
    <!-- run: 1 -->       ... with 1
    <!-- save: PATH -->   the block is put into that file

Commands are the lines that begin with `semblance ` or `build/problems/semblance `, with the lines that continue them
(\\); other lines are what they print. A document's blocks run one after the other in one folder, with a copy of
configs/ in it and the program in the PATH.
"""
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import time

MARK = re.compile(r"^\s*<!-- (run|save)(?:: (\S+))? -->\s*$")


def marked_blocks(lines):
    """(line number, "run" or "save", argument, the block without its indentation)"""
    for at, line in enumerate(lines):
        mark = MARK.match(line)
        if not mark:
            continue
        start = at + 1
        while start < len(lines) and not lines[start].strip():
            start += 1
        end = start
        while end < len(lines) and (lines[end].startswith("    ") or not lines[end].strip()):
            end += 1
        block = [text[4:] for text in lines[start:end]]
        yield at + 1, mark[1], mark[2], "\n".join(block).rstrip() + "\n"


def commands_of(block):
    found = re.findall(r"^(?:build/problems/)?(semblance (?:.*\\\n)*.*)$", block, re.MULTILINE)
    return [re.sub(r"\s+#.*$", "", command) for command in found]


def run_document(program, source, path):
    """Returns how many commands ran, and what went wrong."""
    ran, faults = 0, []
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        shutil.copytree(source / "configs", folder / "configs")
        (folder / "bin").mkdir()
        (folder / "bin" / "semblance").symlink_to(program)
        environment = {**os.environ, "PATH": f"{folder / 'bin'}:{os.environ['PATH']}"}
        for line, what, argument, block in marked_blocks(path.read_text().splitlines()):
            if what == "save":
                target = folder / argument
                target.parent.mkdir(parents=True, exist_ok=True)
                target.write_text(block)
                continue
            commands = commands_of(block)
            if not commands:
                faults.append(f"{path.name}:{line}: the block has no command")
            for command in commands:
                start = time.monotonic()
                done = subprocess.run(["bash", "-c", command], cwd=folder, env=environment, text=True,
                                      stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
                ran += 1
                print(f"{path.name}:{line}: {command} ({time.monotonic() - start:.1f} s)", flush=True)
                if done.returncode != int(argument or 0):
                    faults.append(f"{path.name}:{line}: {command}: ended with {done.returncode}:\n{done.stdout}")
    return ran, faults


def main():
    program, source = pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2]).resolve()
    faults = []
    for name in sys.argv[3:]:
        ran, found = run_document(program, source, pathlib.Path(name))
        faults += found if ran else [f"{name}: no block is marked to run"]
    print("\n".join(faults))
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
