# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes a CT of a head of concentric balls as DICOM slices (explicit little endian), with Python's standard library."""
import array
import struct

LONG = ("OB", "OW", "SQ", "UN")


def entry(group, element, kind, value):
    if isinstance(value, str):
        value = value.encode()
    if len(value) % 2:
        value += b"\0" if kind in ("UI", "OB") else b" "
    head = struct.pack("<HH2s", group, element, kind.encode())
    return head + (struct.pack("<HI", 0, len(value)) if kind in LONG else struct.pack("<H", len(value))) + value


def number(n):
    return struct.pack("<H", n)


def head_at(x, y, z):
    """Hounsfield units: skin of radius 80 mm, skull from 70 to 62 mm."""
    r = (x * x + y * y + z * z) ** 0.5
    edge = lambda radius: min(1.0, max(0.0, 0.5 - (r - radius) / 3))
    hu = -1000.0
    for value, radius in ((40, 80), (1000, 70), (40, 62)):
        hu += edge(radius) * (value - hu)
    return round(hu)


def write_slices(folder, count=40, size=64, spacing_mm=3.0, name="IM{:04d}"):
    """Writes the slices, bottom first, and returns their paths. The head is cut 40 mm below its centre."""
    ct = "1.2.840.10008.5.1.4.1.1.2"
    paths = []
    for k in range(count):
        z = -40 + spacing_mm * k
        half = spacing_mm * (size - 1) / 2
        voxels = array.array("h", (head_at(spacing_mm * i - half, spacing_mm * j - half, z)
                                   for j in range(size) for i in range(size)))
        instance = f"1.2.3.4.{k + 1}"
        meta = b"".join([entry(2, 1, "OB", b"\0\1"), entry(2, 2, "UI", ct), entry(2, 3, "UI", instance),
                         entry(2, 0x10, "UI", "1.2.840.10008.1.2.1"), entry(2, 0x12, "UI", "1.2.3.4")])
        data = b"".join([
            entry(8, 0x16, "UI", ct), entry(8, 0x18, "UI", instance), entry(8, 0x60, "CS", "CT"),
            entry(0x20, 0xD, "UI", "1.2.3"), entry(0x20, 0xE, "UI", "1.2.3.1"), entry(0x20, 0x11, "IS", "1"),
            entry(0x20, 0x13, "IS", str(k + 1)), entry(0x20, 0x32, "DS", f"{-half}\\{-half}\\{z}"),
            entry(0x20, 0x37, "DS", "1\\0\\0\\0\\1\\0"), entry(0x28, 2, "US", number(1)),
            entry(0x28, 4, "CS", "MONOCHROME2"), entry(0x28, 0x10, "US", number(size)), entry(0x28, 0x11, "US", number(size)),
            entry(0x28, 0x30, "DS", f"{spacing_mm}\\{spacing_mm}"), entry(0x28, 0x100, "US", number(16)),
            entry(0x28, 0x101, "US", number(16)), entry(0x28, 0x102, "US", number(15)), entry(0x28, 0x103, "US", number(1)),
            entry(0x28, 0x1052, "DS", "0"), entry(0x28, 0x1053, "DS", "1"), entry(0x7FE0, 0x10, "OW", voxels.tobytes())])
        path = folder / name.format(k)
        path.write_bytes(b"\0" * 128 + b"DICM" + entry(2, 0, "UL", struct.pack("<I", len(meta))) + meta + data)
        paths.append(path)
    return paths
