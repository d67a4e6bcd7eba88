"""Clouds and models that are bad in ways of their own."""

from __future__ import annotations

import json
import struct
from collections.abc import Callable, Iterator

import numpy as np

from tests.bad_input.makers import evil_npy, glb, npy_header, zip_bomb, zipped
from tests.bad_input.samples import COUNT, POINTS, data_of, glb_of, npy, npz, pcd, ply, text, vtk

TRILLION = 10**12
COUNTS = (TRILLION, 10**30, -1, 0, "many")

Made = tuple[str, str, "bytes | Callable[[], bytes]"]
"""The sample's name, what is bad, and the data or what makes them."""


def clouds() -> Iterator[Made]:
    rows, big = POINTS.astype("<f4").tobytes(), POINTS.astype(">f4").tobytes()
    lines = text(POINTS).encode()
    for count in COUNTS:
        yield "ascii.ply", f"{count} points", ply("ascii", count)
        yield "little.ply", f"{count} points", ply("binary_little_endian", count)
        yield "big.ply", f"{count} points", ply("binary_big_endian", count)
        yield "ascii.pcd", f"{count} points", pcd("ascii", lines, count)
        yield "binary.pcd", f"{count} points", pcd("binary", rows, count)
        yield (
            "packed.pcd",
            f"{count} points",
            pcd("binary_compressed", struct.pack("<II", 9, 12) + rows, count),
        )
        yield "ascii.vtk", f"{count} points", vtk("ASCII", lines, count)
        yield "binary.vtk", f"{count} points", vtk("BINARY", big, count)
        if count != "many":  # words name the columns
            yield "a.pts", f"{count} points", f"{count}\n".encode() + (lines if count else b"")
    nan, infinite = np.full((COUNT, 3), np.nan), np.full((COUNT, 3), -np.inf)
    for what, points in (("NaN", nan), ("infinite", infinite)):
        yield "ascii.ply", f"all {what}", ply("ascii", COUNT, points)
        yield "little.ply", f"all {what}", ply("binary_little_endian", COUNT, points)
        yield "a.xyz", f"all {what}", text(points).encode()
        yield "cloud.npy", f"all {what}", npy(points)
        yield "a.npz", f"all {what}", npz(points=points)
        yield "000001.bin", f"all {what}", np.hstack([points, points[:, :1]]).astype("<f4").tobytes()
        yield "binary.vtk", f"all {what}", vtk("BINARY", points.astype(">f4").tobytes())
        yield "binary.pcd", f"all {what}", pcd("binary", points.astype("<f4").tobytes())
    yield (
        "little.ply",
        "the wrong byte order",
        ply("binary_little_endian", points=POINTS.astype("<f4").byteswap()),
    )
    yield "big.ply", "the wrong byte order", ply("binary_big_endian", points=POINTS.astype("<f4").byteswap())
    yield "binary.vtk", "the wrong byte order", vtk("BINARY", rows)
    yield "000001.bin", "the wrong byte order", np.hstack([POINTS, POINTS]).astype(">f4").tobytes()
    yield "binary.pcd", "the wrong byte order", pcd("binary", big)
    yield "binary.pcd", "fields of 10^9 bytes", pcd("binary", rows, size=10**9)
    yield "binary.pcd", "fields of -4 bytes", pcd("binary", rows, size=-4)
    width = b"FIELDS x\nSIZE 4\nTYPE F\nCOUNT %d\nWIDTH 1\nHEIGHT 1\nDATA binary\n"
    yield "binary.pcd", "a field of 10^12 numbers", b"VERSION 0.7\n" + width % TRILLION
    yield (
        "binary.pcd",
        "10^6 by 10^6 points",
        b"FIELDS x\nSIZE 4\nTYPE F\nWIDTH 1000000\nHEIGHT 1000000\nDATA binary\n",
    )
    yield "packed.pcd", "unpacks to 4 GB", pcd("binary_compressed", struct.pack("<II", 9, 2**32 - 1) + rows)
    for shape in ((TRILLION, 3), (3, TRILLION), (-1, 3), (0, 3), (2**40, 2**40)):
        header = npy_header(shape)
        yield "cloud.npy", f"shape {shape}", header + rows
        yield "a.npz", f"shape {shape}", zipped({"points.npy": header + rows})
    yield "cloud.npy", "pickled", npy(np.array([{"x": 1}], object))
    yield "a.npz", "pickled", npz(points=np.array([{"x": 1}], object))
    yield "cloud.npy", "a bad pickle", evil_npy()
    yield "a.npz", "a bad pickle", zipped({"points.npy": evil_npy()})
    yield "a.npz", "a bomb", zip_bomb("points.npy", 2 << 30)
    yield "a.npz", "a bomb that lies of its size", zip_bomb("points.npy", 2 << 30, 1000)
    yield "a.npz", "a path out of it", zipped({"../points.npy": npy(POINTS)})
    yield "a.xyz", "one line of 9 MB", b"1 2 3 " * 1_500_000
    yield "a.xyz", "lines of different lengths", b"1 2 3\n1 2 3 4\n1 2\n"
    yield "a.csv", "columns that are named twice", b"x,x,y,z\n1,2,3,4\n"
    yield "a.csv", "hexadecimal", b"x,y,z\n0x1,0x2,0x3\n"
    yield "a.csv", "commas of two meanings", b"1,050,2,040,3,000\n4,010,5,020,6,030\n"
    yield "decimal.csv", "commas of two meanings", b"1,234;5;6,789\n2,345;6;7,891\n"
    yield "decimal.csv", "titles of degrees", b"lat;lon;alt\n48,1;11,5;519\n"
    yield "titled.txt", "more points than counted", b"1\n1 2 3\n4 5 6\n"
    yield "titled.txt", "a count of 10^30", b"1" + b"0" * 30 + b"\n1 2 3\n"
    yield "titled.txt", "titles of other columns", b"a b c\n1 2 3\n"
    yield "LIDAR_TOP.pcd.bin", "rows of three", np.ones((1, 7), "<f4").tobytes()
    yield "ascii.ply", "a property twice", ply("ascii").replace(b"float y", b"float x")
    yield "ascii.ply", "no property", b"ply\nformat ascii 1.0\nelement vertex 3\nend_header\n1 2 3\n"
    yield "ascii.ply", "a header without an end", b"ply\n" + b"comment x\n" * 100_000


def models() -> Iterator[Made]:
    for name in ("a.glb", "mesh.glb"):
        for what, accessor in (
            ("10^12 vertices", {"count": TRILLION}),
            ("-1 vertices", {"count": -1}),
            ("a view that is not there", {"bufferView": 99}),
        ):
            yield name, what, glb(accessor)
        yield name, "a buffer of the file /etc/passwd", glb({}, {"uri": "/etc/passwd", "byteLength": 36})
        yield name, "a buffer of ../good.png", glb({}, {"uri": "../good.png", "byteLength": 36})
        yield name, "a scene that holds itself", glb({}, nodes=[{"children": [0], "mesh": 0}])
        yield name, "JSON 900 deep", glb_of({"extras": json.loads("[" * 900 + "]" * 900)})
        yield name, "a header of 4 GB", struct.pack("<4sII", b"glTF", 2, 2**32 - 1) + bytes(99)
    for name in ("a.stl", "mesh.stl"):
        yield name, "4 billion triangles", bytes(80) + struct.pack("<I", 2**32 - 1) + bytes(50)
        yield name, "no triangle", bytes(80) + struct.pack("<I", 0)
        yield name, "NaN", bytes(80) + struct.pack("<I", 1) + np.full(12, np.nan, "<f4").tobytes() + b"\0\0"
    for name in ("a.obj", "mesh.obj"):
        yield name, "NaN", b"v nan nan nan\n" * 3 + b"f 1 2 3\n"
        yield name, "material ../../etc/passwd", b"mtllib ../../../etc/passwd\nusemtl a\n"
    yield "mesh.obj", "corners that are not there", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 900000000\n"
    yield "mesh.obj", "negative corners", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf -1 -2 -99\n"
    face = "ply\nformat {} 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
    face += "element face {}\nproperty list uchar int vertex_indices\nend_header\n"
    corners = "0 0 0\n1 0 0\n0 1 0\n"
    yield "mesh.ply", "10^12 faces", (face.format("ascii", TRILLION) + corners + "3 0 1 2\n").encode()
    yield "mesh.ply", "-1 faces", (face.format("ascii", -1) + corners + "3 0 1 2\n").encode()
    yield (
        "mesh.ply",
        "corners that are not there",
        (face.format("ascii", 1) + corners + "3 0 1 99\n").encode(),
    )
    yield "mesh.ply", "NaN", (face.format("ascii", 1) + "nan 0 0\n" * 3 + "3 0 1 2\n").encode()
    yield "mesh.ply", "10^12 vertices", ply("binary_little_endian", TRILLION)
    for kind in ("a.las", "a.laz"):
        good = data_of(kind)
        yield kind, "4 billion points", good[:107] + struct.pack("<I", 2**32 - 1) + good[111:]
        yield kind, "points that begin beyond the end", good[:96] + struct.pack("<I", 2**32 - 1) + good[100:]
        yield kind, "points of 0 bytes", good[:105] + struct.pack("<H", 0) + good[107:]
        yield kind, "4 billion further records", good[:100] + struct.pack("<I", 2**32 - 1) + good[104:]
