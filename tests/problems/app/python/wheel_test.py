# SPDX-License-Identifier: GPL-3.0-or-later
"""The wheel of `pip install .`, made of the present build: pip installs it, and Python imports it from there."""
import os
import subprocess
import sys
import tempfile

source = os.path.abspath(sys.argv[1])
sys.path.insert(0, os.path.join(source, "problems", "app", "python"))
import wheel_backend

try:
    import pip
except ImportError:
    print("skipped: pip is not installed (Debian: python3-pip)")
    sys.exit(77)
with tempfile.TemporaryDirectory() as folder:
    name = wheel_backend.build_wheel(folder, {"build-dir": os.environ["SEMBLANCE_BUILD"]})
    there = os.path.join(folder, "installed")
    subprocess.run([sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--no-index", "--target", there, os.path.join(folder, name)], check=True)
    code = "import semblance, importlib.metadata; print(semblance.__file__); print(importlib.metadata.version('semblance') == semblance.__version__)"
    environment = {**os.environ, "PYTHONPATH": there}
    printed = subprocess.run([sys.executable, "-c", code], env=environment, cwd=folder, check=True, capture_output=True, text=True).stdout.split()
    assert printed == [os.path.join(there, "semblance", "__init__.py"), "True"], printed
print("ok")
