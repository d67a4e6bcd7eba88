"""Files that lie: headers that promise, archives and images that unpack to too much."""

from __future__ import annotations

import io
import pickle
import struct
import zipfile
import zlib

import numpy as np

from tests.bad_input.samples import RGB, glb_of, opencv


def npy_header(shape: tuple[int, ...], kind: str = "<f4") -> bytes:
    told = f"{{'descr': '{kind}', 'fortran_order': False, 'shape': {shape}, }}".encode()
    told += b" " * (-(len(told) + 11) % 64) + b"\n"
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(told)) + told


class Evil:
    def __reduce__(self):
        return exec, ("raise SystemExit('a pickle was run')",)


def evil_npy() -> bytes:
    """Runs what it holds if it is read as a pickle."""
    return npy_header((1, 3), "|O") + pickle.dumps(Evil())


def zipped(files: dict[str | zipfile.ZipInfo, bytes]) -> bytes:
    """The same bytes whenever it is called: all is of 1980."""
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as archive:
        for name, data in files.items():
            item = zipfile.ZipInfo(name) if isinstance(name, str) else name
            archive.writestr(item, data, zipfile.ZIP_DEFLATED)
    return stream.getvalue()


def zip_bomb(name: str, size_bytes: int, said_bytes: int | None = None) -> bytes:
    """A file of zeros in an archive of a few kilobytes, which may say that it is small."""
    row = 1 << 20
    packed = deflated_zeros(row, size_bytes // row)[2:-4]
    said = said_bytes or size_bytes
    sizes = struct.pack("<IIIHH", 0, len(packed), said, len(name), 0)
    local = b"PK\3\4" + struct.pack("<HHHHH", 20, 0, 8, 0, 33) + sizes + name.encode()
    entry = b"PK\1\2" + struct.pack("<HHHHHH", 20, 20, 0, 8, 0, 33) + sizes
    entry += struct.pack("<HHHII", 0, 0, 0, 0, 0) + name.encode()
    end = struct.pack("<HHHHIIH", 0, 0, 1, 1, len(entry), len(local) + len(packed), 0)
    return local + packed + entry + b"PK\5\6" + end


def png_of(width: int, height: int, deep: bool, whole: bool = True) -> bytes:
    """All black; whole, or of a header that claims it."""
    bits, channels = (16, 0) if deep else (8, 2)
    row = 1 + width * (2 if deep else 3) if whole else 100
    packed = deflated_zeros(row, height if whole else 3)
    chunks = [(b"IHDR", struct.pack(">IIBBBBB", width, height, bits, channels, 0, 0, 0))]
    chunks += [(b"IDAT", packed), (b"IEND", b"")]
    return b"\x89PNG\r\n\x1a\n" + b"".join(
        struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))
        for kind, body in chunks
    )


def deflated_zeros(row: int, count: int) -> bytes:
    """``count`` rows of so many zeros as zlib packs them, without packing each."""
    packer = zlib.compressobj(9, zlib.DEFLATED, -15)
    block = packer.compress(bytes(row)) + packer.flush(zlib.Z_FULL_FLUSH)
    end = zlib.compressobj(9, zlib.DEFLATED, -15).flush()
    checksum = (row * count % 65521) << 16 | 1
    return b"\x78\xda" + block * count + end + struct.pack(">I", checksum)


def jpeg_of(width: int, height: int) -> bytes:
    """A good one whose header claims another size."""
    data = bytearray(opencv(RGB, ".jpg"))
    at = data.index(b"\xff\xc0") + 5
    data[at : at + 4] = struct.pack(">HH", height, width)
    return bytes(data)


def tiff_of(width: int, height: int, order: str, mark: bytes, next_at: int = 0) -> bytes:
    """A header that claims a size, and one strip of a few bytes."""
    entries = [(256, 4, 1, width), (257, 4, 1, height), (258, 4, 1, 16), (259, 4, 1, 1), (262, 4, 1, 1)]
    entries += [(273, 4, 1, 200), (277, 4, 1, 1), (278, 4, 1, height), (279, 4, 1, 30)]
    body = struct.pack(f"{order}H", len(entries))
    body += b"".join(struct.pack(f"{order}HHII", *entry) for entry in entries)
    whole = mark + struct.pack(f"{order}I", 8) + body + struct.pack(f"{order}I", next_at)
    return whole.ljust(200, b"\0") + bytes(30)


def packed_tiff(side: int) -> bytes:
    """Deflated rows, all black."""
    packed = deflated_zeros(side, side)
    entries = [(256, 4, 1, side), (257, 4, 1, side), (258, 3, 1, 8), (259, 3, 1, 8), (262, 3, 1, 1)]
    entries += [(273, 4, 1, 200), (277, 3, 1, 1), (278, 4, 1, side), (279, 4, 1, len(packed))]
    body = struct.pack("<H", len(entries))
    body += b"".join(struct.pack("<HHII", *entry) for entry in entries)
    return (b"II*\0" + struct.pack("<I", 8) + body + bytes(4)).ljust(200, b"\0") + packed


def glb(accessor: dict, buffer: dict | None = None, nodes: list | None = None) -> bytes:
    """A triangle whose accessor, buffer or nodes are something else."""
    body = np.eye(3, dtype="<f4").tobytes() + struct.pack("<III", 0, 1, 2)
    document = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": nodes or [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "buffers": [buffer or {"byteLength": len(body)}],
        "bufferViews": [{"buffer": 0, "byteLength": 36}, {"buffer": 0, "byteOffset": 36, "byteLength": 12}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"} | accessor,
            {"bufferView": 1, "componentType": 5125, "count": 3, "type": "SCALAR"},
        ],
    }
    return glb_of(document, b"" if buffer else body)
