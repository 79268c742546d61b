# SPDX-License-Identifier: GPL-3.0-or-later
"""Good files of every kind, small, in one folder: made here, or by the program itself."""
import gzip
import io
import math
import pathlib
import random
import struct
import subprocess
import sys
import tarfile

SMALLEST = {"subject.rings": 16, "implicit.resolution": 16, "implicit.target_triangles": 400, "template": "{type: formula, max_level: 1, patches_u: 6, patches_v: 6}",
            "seeds.level": 0, "first_fit": "[]", "fit.plan": "{type: listed, schedule: [{level: 0}, {level: 1}]}"}


def ball(radius=80.0, around=18, up=12):
    """Vertices and triangles of a sphere, outwards."""
    points = [(0.0, 0.0, radius)]
    for j in range(1, up):
        for i in range(around):
            a, b = 2 * math.pi * i / around, math.pi * j / up
            points.append((radius * math.sin(b) * math.cos(a), radius * math.sin(b) * math.sin(a), radius * math.cos(b)))
    points.append((0.0, 0.0, -radius))
    at = lambda j, i: 1 + (j - 1) * around + i % around
    faces = [(0, at(1, i), at(1, i + 1)) for i in range(around)]
    for j in range(1, up - 1):
        for i in range(around):
            faces += [(at(j, i), at(j + 1, i), at(j + 1, i + 1)), (at(j, i), at(j + 1, i + 1), at(j, i + 1))]
    last = len(points) - 1
    faces += [(last, at(up - 1, i + 1), at(up - 1, i)) for i in range(around)]
    return points, faces


def ply_head(kind, points, faces):
    return (f"ply\nformat {kind} 1.0\ncomment a ball\nelement vertex {len(points)}\nproperty float x\nproperty float y\nproperty float z\n"
            f"element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n").encode()


def binary_ply(order, points, faces):
    name = "binary_little_endian" if order == "<" else "binary_big_endian"
    return ply_head(name, points, faces) + b"".join(struct.pack(order + "3f", *p) for p in points) + b"".join(
        struct.pack(order + "B3i", 3, *f) for f in faces)


def rows(values, form="{:.5g}"):
    return "".join(" ".join(form.format(v) for v in row) + "\n" for row in values)


def stl_texts(points, faces):
    facet = lambda f: "facet normal 0 0 0\nouter loop\n" + "".join("vertex {:.5g} {:.5g} {:.5g}\n".format(*points[k]) for k in f) + "endloop\nendfacet\n"
    binary = b"\0" * 80 + struct.pack("<I", len(faces)) + b"".join(
        struct.pack("<12f", 0, 0, 0, *points[f[0]], *points[f[1]], *points[f[2]]) + b"\0\0" for f in faces)
    return ("solid ball\n" + "".join(map(facet, faces)) + "endsolid ball\n").encode(), binary


def meshes():
    points, faces = ball()
    ascii_stl, binary_stl = stl_texts(points, faces)
    return {
        "ball.ply": ply_head("ascii", points, faces) + (rows(points) + rows([(3, *f) for f in faces], "{}")).encode(),
        "ball_le.ply": binary_ply("<", points, faces),
        "ball_be.ply": binary_ply(">", points, faces),
        "ball.obj": ("# a ball\n" + "".join("v " + r for r in rows(points).splitlines(True))
                     + "".join("f {}//{} {} {}\n".format(f[0] + 1, f[0] + 1, f[1] + 1, f[2] + 1) for f in faces)).encode(),
        "ball.off": (f"OFF\n{len(points)} {len(faces)} 0\n" + rows(points) + rows([(3, *f) for f in faces], "{}")).encode(),
        "ball.stl": ascii_stl,
        "ball_bin.stl": binary_stl,
    }


# ---------------------------------------------------------------------------------------------- volumes


VOXELS, STEP_MM = 36, 6.0


def head_voxels():
    """A bone shell in a ball of tissue, in Hounsfield units, as little-endian int16."""
    values, half = [], (VOXELS - 1) / 2
    for k in range(VOXELS):
        for j in range(VOXELS):
            for i in range(VOXELS):
                r = STEP_MM * math.dist((i, j, k), (half, half, half))
                values.append(-1000 if r > 95 else 40 if r > 80 or r < 68 else 900)
    return struct.pack(f"<{len(values)}h", *values)


def nifti(voxels):
    head = bytearray(352)
    struct.pack_into("<i", head, 0, 348)
    struct.pack_into("<8h", head, 40, 3, VOXELS, VOXELS, VOXELS, 1, 1, 1, 1)
    struct.pack_into("<2h", head, 70, 4, 16)
    struct.pack_into("<8f", head, 76, 1, STEP_MM, STEP_MM, STEP_MM, 1, 1, 1, 1)
    struct.pack_into("<3f", head, 108, 352, 1, 0)
    head[123] = 2
    struct.pack_into("<2h", head, 252, 0, 1)
    for row in range(3):
        struct.pack_into("<4f", head, 280 + 16 * row, *[STEP_MM if c == row else 0 for c in range(4)])
    head[344:348] = b"n+1\0"
    return bytes(head) + voxels


def nrrd(voxels, encoding="raw", data_file=""):
    text = (f"NRRD0004\ntype: int16\ndimension: 3\nspace: left-posterior-superior\nsizes: {VOXELS} {VOXELS} {VOXELS}\n"
            f"space directions: ({STEP_MM},0,0) (0,{STEP_MM},0) (0,0,{STEP_MM})\nspace origin: (0,0,0)\nkinds: domain domain domain\n"
            f"endian: little\nencoding: {encoding}\n" + (f"data file: {data_file}\n" if data_file else "\n"))
    packed = gzip.compress(voxels, mtime=0) if encoding == "gzip" else voxels
    return text.encode() + (b"" if data_file else packed)


def meta_image(voxels, data_file="LOCAL"):
    return (f"ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\nCompressedData = False\nTransformMatrix = 1 0 0 0 1 0 0 0 1\n"
            f"Offset = 0 0 0\nElementSpacing = {STEP_MM} {STEP_MM} {STEP_MM}\nDimSize = {VOXELS} {VOXELS} {VOXELS}\nElementType = MET_SHORT\n"
            f"ElementDataFile = {data_file}\n").encode() + (voxels if data_file == "LOCAL" else b"")


PLIST = f"""<?xml version="1.0" encoding="UTF-8"?>
<plist version="1.0"><dict><key>matrix</key><dict><key>dtype</key><string>int16</string><key>filename</key><string>matrix.dat</string>
<key>shape</key><array><integer>{VOXELS}</integer><integer>{VOXELS}</integer><integer>{VOXELS}</integer></array></dict>
<key>orientation</key><integer>1</integer><key>spacing</key><array><real>{STEP_MM}</real><real>{STEP_MM}</real><real>{STEP_MM}</real></array></dict></plist>
""".encode()


def packed(entries):
    """A tar of (name, bytes)."""
    out = io.BytesIO()
    with tarfile.open(fileobj=out, mode="w", format=tarfile.USTAR_FORMAT) as tar:
        for name, data in entries:
            info = tarfile.TarInfo(name)
            info.size = len(data)
            tar.addfile(info, io.BytesIO(data))
    return out.getvalue()


def volumes():
    voxels = head_voxels()
    return {"head.nii": nifti(voxels), "head.nii.gz": gzip.compress(nifti(voxels), mtime=0), "head.nrrd": nrrd(voxels),
            "head_gz.nrrd": nrrd(voxels, "gzip"), "head.nhdr": nrrd(voxels, data_file="head.raw"), "head.raw": voxels, "head.mha": meta_image(voxels),
            "head.mhd": meta_image(voxels, "head.raw"), "head.inv3": packed([("main.plist", PLIST), ("matrix.dat", voxels)])}


# ---------------------------------------------------------------------------------------------- points


def npy(values, columns):
    head = f"{{'descr': '<f8', 'fortran_order': False, 'shape': ({len(values)}, {columns}), }}"
    head += " " * (-(10 + len(head) + 1) % 64) + "\n"
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(head)) + head.encode() + b"".join(struct.pack(f"<{columns}d", *v) for v in values)


def points():
    draw = random.Random(3)
    uv = [(draw.random(), draw.random()) for _ in range(60)]
    values = [(10 * u, 10 * v, math.sin(3 * u) * v + draw.gauss(0, 0.01), u, v) for u, v in uv]
    csv = ("x,y,z,u,v\n" + "".join(",".join(f"{c:.5f}" for c in p) + "\n" for p in values)).encode()
    xyz = rows([p[:3] for p in values]).encode()
    ply = (f"ply\nformat ascii 1.0\nelement vertex {len(values)}\nproperty float x\nproperty float y\nproperty float z\nproperty float u\nproperty float v\n"
           "end_header\n" + rows(values)).encode()
    return {"points.csv": csv, "points.xyz": xyz, "points.npy": npy(values, 5), "points.ply": ply, "points.csv.gz": gzip.compress(csv, mtime=0),
            "points.obj": "".join("v " + r for r in xyz.decode().splitlines(True)).encode()}


# ---------------------------------------------------------------------------------------------- by the program


class Maker:
    def __init__(self, program, configs, folder):
        self.program, self.configs, self.folder = str(program), configs, pathlib.Path(folder)

    def call(self, *words, allowed=(0,)):
        done = subprocess.run([self.program, *map(str, words)], cwd=self.folder, capture_output=True, text=True, errors="replace", stdin=subprocess.DEVNULL)
        if done.returncode not in allowed:
            sys.exit(f"a good file cannot be made: {words}: {done.returncode}\n{done.stderr}{done.stdout}")

    def write(self, name, data):
        path = self.folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(data.encode() if isinstance(data, str) else data)

    def texts(self):
        base = "".join(f"{path}: {value}\n" for path, value in SMALLEST.items() if "." not in path)
        self.write("experiment.yaml", f"base: {self.configs}/phantom.yaml\nsubject: {{type: phantom, rings: 16}}\n"
                   f"implicit: {{resolution: 16, target_triangles: 400}}\nseeds: {{level: 0}}\nfit: {{plan: {SMALLEST['fit.plan']}}}\n" + base)
        self.write("fit.yaml", "patches_u: 4\npatches_v: 4\nparameters: given\nfit: {plan: {type: auto, finest: 1}}\nreport: false\n")
        self.write("edits.yaml", "resets:\n  - {u: [0.1, 0.3], v: [0.2, 0.4], first_level: 1}\nedits:\n  - {level: 1, i: 3, j: 3, offset: [1, 0.5, -1]}\n"
                   "  - {level: 0, i: 2, j: 2, offset: [0, 0, 1]}\n")
        self.write("study.yaml", "title: attacked\nbase: experiment.yaml\njob: depth\nsubjects:\n  - {name: a, set: {subject.random_seed: 1}}\n"
                   "  - {name: b, set: {subject.random_seed: 2}}\ngrid: {interp: [nearest, mean]}\nmetric: depth_truth.along_direction.rms_mm\n")
        self.write("crowd.yaml", "title: crowd\nphantoms: {count: 4, like: {rings: 16}}\nmeasure: {dense: {columns: 16, rows: 16, modes: 1}}\n")
        self.write("faces.yaml", "title: faces\nbase: experiment.yaml\ngrid: {interp: [nearest, mean]}\nkeep: run\n")
        for name in ("tables/t_table_2023.yaml", "networks/standard32.yaml", "landmarks/cranium.yaml"):
            self.write(pathlib.Path(name).name, (self.configs / name).read_bytes())

    def heads(self):
        self.call("run", "experiment.yaml", "--out", "run", "--quiet")
        self.call("phantom", "--head", "smooth", "--out", "phantom", "--pixel-mm", "5", "--slice-mm", "8")
        self.call("import-ct", "phantom/ct", "--out", "import", "--quiet")
        self.write("head.yaml", f"base: {self.configs}/phantom.yaml\nsubject: {{type: files, skull: import/skull.ply, skin: import/skin.ply, "
                   "landmarks: phantom/landmarks.yaml}\n")
        for ending in (".mrk.json", ".fcsv", ".pp", ".csv", ".txt", ".asc"):
            self.call("landmarks", "convert", "phantom/landmarks.yaml", "landmarks" + ending)

    def faces(self):
        face = "run/face.hspline.json"
        self.call("feature", "extract", face, "--name", "nose", "--library", "library", "--u", "0.2", "0.6", "--v", "0.2", "0.6")
        self.call("feature", "mirror", "library/nose.json", "--name", "other", "--library", "library")
        self.call("template", "experiment.yaml", "--out", "template")
        self.call("export", "template/head.hspline.json", "--to", "mean.ply", "--chord_mm", "5")

    def studies(self):
        for name in ("study", "faces"):
            self.call("study", f"{name}.yaml", "--out", name, "--quiet", allowed=(0, 1))
        for shard in (0, 1):
            self.call("study", "study.yaml", "--out", f"shard{shard}", "--shard", f"{shard}/2", "--quiet")
        self.call("population", "crowd.yaml", "--out", "crowd", "--quiet")


def make(program, configs, folder):
    """Fills the folder; ends the program where a file cannot be made."""
    maker = Maker(program, configs, folder)
    for kind in (meshes(), volumes(), points()):
        for name, data in kind.items():
            maker.write(name, data)
    maker.texts()
    maker.heads()
    maker.faces()
    maker.studies()
