# SPDX-License-Identifier: GPL-3.0-or-later
"""Builds a wheel of the package with CMake, for `pip install .` (PEP 517). It needs no package of PyPI.

`pip install . --config-settings build-dir=DIR` builds in a given folder; default: build-wheel.
"""
import base64
import hashlib
import os
import pathlib
import subprocess
import sysconfig
import tempfile
import zipfile

SOURCE = pathlib.Path(__file__).resolve().parents[3]
FOLDER = pathlib.Path("lib/python3/dist-packages")


def build_wheel(wheel_directory, config_settings=None, metadata_directory=None):
    build = SOURCE / (config_settings or {}).get("build-dir", "build-wheel")
    if not (build / "CMakeCache.txt").exists():
        subprocess.run(["cmake", "-S", SOURCE, "-B", build, "-G", "Ninja", "-DBUILD_TESTING=OFF"], check=True)
    subprocess.run(["cmake", "--build", build, "--target", "semblance_python"], check=True)
    with tempfile.TemporaryDirectory() as stage:
        subprocess.run(["cmake", "--install", build, "--component", "python", "--prefix", stage, "--strip"], check=True)
        return _zip(pathlib.Path(stage) / FOLDER, wheel_directory)


def _zip(folder, wheel_directory):
    tag = "cp{0}-cp{0}-{1}".format(sysconfig.get_config_var("py_version_nodot"), sysconfig.get_platform().replace("-", "_").replace(".", "_"))
    info = next(folder.glob("semblance-*.dist-info"))
    (info / "INSTALLER").unlink()
    (info / "WHEEL").write_text(f"Wheel-Version: 1.0\nGenerator: semblance\nRoot-Is-Purelib: false\nTag: {tag}\n")
    files = sorted(path for path in folder.rglob("*") if path.is_file())
    record = "".join(f"{path.relative_to(folder)},sha256={_hash(path)},{path.stat().st_size}\n" for path in files)
    (info / "RECORD").write_text(f"{record}{info.name}/RECORD,,\n")
    name = f"{info.name.removesuffix('.dist-info')}-{tag}.whl"
    with zipfile.ZipFile(os.path.join(wheel_directory, name), "w", zipfile.ZIP_DEFLATED) as wheel:
        for path in [*files, info / "RECORD"]:
            wheel.write(path, path.relative_to(folder))
    return name


def _hash(path):
    return base64.urlsafe_b64encode(hashlib.sha256(path.read_bytes()).digest()).rstrip(b"=").decode()


def build_sdist(sdist_directory, config_settings=None):
    raise NotImplementedError("install from a clone; there is no archive of the source")
