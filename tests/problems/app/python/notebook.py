# SPDX-License-Identifier: GPL-3.0-or-later
"""Executes docs/examples/first_face.ipynb: no cell fails, and the run displays its 3-D view."""
import os
import subprocess
import sys
import tempfile

source = os.path.abspath(sys.argv[1])
try:
    import ipykernel
    import nbconvert
except ImportError:
    print("skipped: nbconvert is not installed (Debian: jupyter-nbconvert, python3-ipykernel)")
    sys.exit(77)
notebook = os.path.join(source, "docs", "examples", "first_face.ipynb")
with tempfile.TemporaryDirectory() as folder:
    subprocess.run([sys.executable, "-m", "nbconvert", "--to", "html", "--execute", "--output-dir", folder, notebook], check=True)
    with open(os.path.join(folder, "first_face.html"), encoding="utf-8") as page:
        text = page.read()
assert "view3d-scenes" in text and "one depth everywhere" in text
print("ok")
