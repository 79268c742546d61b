# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs the Python of docs/how-to/python.md, block after block, as they are written there."""
import os
import re
import sys
import tempfile

source = os.path.abspath(sys.argv[1])
with open(os.path.join(source, "docs", "how-to", "python.md"), encoding="utf-8") as page:
    blocks = re.findall(r"^```python\n(.*?)^```$", page.read(), re.M | re.S)
assert len(blocks) >= 4, len(blocks)
names = {"CONFIGS": os.path.join(source, "configs")}
with tempfile.TemporaryDirectory() as folder:
    os.chdir(folder)
    for number, block in enumerate(blocks, 1):
        print(f"--- block {number}\n{block}")
        exec(compile(block, f"docs/how-to/python.md, block {number}", "exec"), names)
    os.chdir(source)
