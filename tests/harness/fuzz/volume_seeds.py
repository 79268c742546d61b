# SPDX-License-Identifier: GPL-3.0-or-later
"""Small good volumes for volume_fuzz to begin with, in a folder.   usage: volume_seeds.py FOLDER"""
import gzip
import pathlib
import struct
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent))
import seeds


def element(group, number, kind, value):
    value = value.encode() if isinstance(value, str) else value
    value += (b"\0" if kind == "UI" else b" ") * (len(value) % 2)
    length = struct.pack("<HI", 0, len(value)) if kind in ("OB", "OW") else struct.pack("<H", len(value))
    return struct.pack("<HH", group, number) + kind.encode() + length + value


def dicom(voxels, side):
    """One slice of a CT, explicit little-endian."""
    meta = element(2, 0x02, "UI", "1.2.840.10008.5.1.4.1.1.2") + element(2, 0x03, "UI", "1.2.3") + element(2, 0x10, "UI", "1.2.840.10008.1.2.1")
    rows = struct.pack("<H", side)
    body = b"".join([
        element(8, 0x16, "UI", "1.2.840.10008.5.1.4.1.1.2"), element(8, 0x18, "UI", "1.2.3"), element(8, 0x60, "CS", "CT"), element(0x20, 0x0D, "UI", "1.2"),
        element(0x20, 0x0E, "UI", "1.2.1"), element(0x20, 0x11, "IS", "1"), element(0x20, 0x13, "IS", "1"), element(0x20, 0x32, "DS", "0\\0\\0"),
        element(0x20, 0x37, "DS", "1\\0\\0\\0\\1\\0"), element(0x28, 2, "US", b"\1\0"), element(0x28, 4, "CS", "MONOCHROME2"), element(0x28, 0x10, "US", rows),
        element(0x28, 0x11, "US", rows), element(0x28, 0x30, "DS", "2\\2"), element(0x28, 0x100, "US", b"\x10\0"), element(0x28, 0x101, "US", b"\x10\0"),
        element(0x28, 0x102, "US", b"\x0f\0"), element(0x28, 0x103, "US", b"\1\0"), element(0x28, 0x1052, "DS", "0"), element(0x28, 0x1053, "DS", "1"),
        element(0x7FE0, 0x10, "OW", voxels)])
    return b"\0" * 128 + b"DICM" + element(2, 0, "UL", struct.pack("<I", len(meta))) + meta + body


def main():
    folder, seeds.VOXELS = pathlib.Path(sys.argv[1]), 8
    voxels = struct.pack("<512h", *[1000 * (k % 3 - 1) for k in range(512)])
    nifti = seeds.nifti(voxels)
    for name, data in {"nifti": b"n" + nifti, "nifti_gz": b"z" + gzip.compress(nifti, mtime=0), "nrrd": b"r" + seeds.nrrd(voxels), "nrrd_gz": b"r" + seeds.nrrd(voxels, "gzip"),
                       "meta": b"m" + seeds.meta_image(voxels), "dicom": b"d" + dicom(voxels[:128], 8)}.items():
        (folder / name).write_bytes(data)


if __name__ == "__main__":
    main()
