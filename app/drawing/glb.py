"""Meshes and lines as binary glTF that a browser draws quickly, even without a graphics card.

All materials are unlit: the light is computed into the vertex colours beforehand. A software renderer would
spend most of a frame on viser's lighting and its ribbon lines.
"""

from __future__ import annotations

import json
import struct
from typing import Any

import numpy as np

from pipeline.types import ByteArray, FloatArray, IntArray

_TYPES = {"<f4": 5126, "<u2": 5123, "<u4": 5125}
_LINES, _TRIANGLES = 1, 4
_CLAMP = 33071
_UNLIT = "KHR_materials_unlit"


def mesh_glb(vertices_m: FloatArray, triangles: IntArray, colors: ByteArray) -> bytes:
    """Return a glTF of (V, 3) vertices, (F, 3) counterclockwise triangles, (V, 3) sRGB; empty if F is 0."""
    if not len(triangles):
        return b""
    rgba = np.full((len(colors), 4), 65535, dtype="<u2")  # linear RGB, as glTF requires
    rgba[:, :3] = _LINEAR[colors]
    return _glb(
        _TRIANGLES,
        {"POSITION": vertices_m.astype("<f4"), "COLOR_0": rgba},
        (1.0, 1.0, 1.0),
        triangles.astype("<u2" if len(vertices_m) < 65535 else "<u4").reshape(-1),
    )


def textured_glb(
    vertices_m: FloatArray, triangles: IntArray, colors: ByteArray, uv: FloatArray, picture: bytes
) -> bytes:
    """Return a mesh textured with a picture times its vertex colours; empty if it has no triangle.

    Args:
        vertices_m: (V, 3) vertices.
        triangles: (F, 3) vertex indices, counterclockwise seen from the front.
        colors: (V, 3) sRGB by which the picture is multiplied.
        uv: (V, 2) texture coordinates, 0 to 1, from the picture's upper left corner.
        picture: a JPEG file.
    """
    if not len(triangles):
        return b""
    rgba = np.full((len(colors), 4), 65535, dtype="<u2")
    rgba[:, :3] = _LINEAR[colors]
    return _glb(
        _TRIANGLES,
        {"POSITION": vertices_m.astype("<f4"), "COLOR_0": rgba, "TEXCOORD_0": uv.astype("<f4")},
        (1.0, 1.0, 1.0),
        triangles.astype("<u2" if len(vertices_m) < 65535 else "<u4").reshape(-1),
        picture,
    )


def lines_glb(segments_m: FloatArray, color: tuple[int, int, int]) -> bytes:
    """Return a glTF of (E, 2, 3) line segments in an sRGB colour, one pixel wide; empty without segments."""
    if not len(segments_m):
        return b""
    red, green, blue = (_LINEAR[list(color)] / 65535.0).tolist()
    return _glb(_LINES, {"POSITION": segments_m.reshape(-1, 3).astype("<f4")}, (red, green, blue))


def _glb(
    mode: int,
    attributes: dict[str, np.ndarray],
    linear_rgb: tuple[float, float, float],
    indices: np.ndarray | None = None,
    picture: bytes = b"",
) -> bytes:
    """Return a glTF of one primitive with one material, which may have a JPEG texture."""
    arrays = list(attributes.values()) + ([] if indices is None else [indices])
    parts = [array.tobytes() for array in arrays] + ([picture] if picture else [])
    blocks = [part + bytes(-len(part) % 4) for part in parts]
    starts = np.cumsum([0, *map(len, blocks)]).tolist()
    primitive: dict[str, Any] = {
        "attributes": {name: row for row, name in enumerate(attributes)},
        "mode": mode,
        "material": 0,
    }
    if indices is not None:
        primitive["indices"] = len(attributes)
    head: dict[str, Any] = {
        "asset": {"version": "2.0"},
        "extensionsUsed": [_UNLIT],
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [primitive]}],
        "materials": [
            {"pbrMetallicRoughness": {"baseColorFactor": [*linear_rgb, 1.0]}, "extensions": {_UNLIT: {}}}
        ],
        "accessors": [_accessor(row, array) for row, array in enumerate(arrays)],
        "bufferViews": [
            {"buffer": 0, "byteOffset": start, "byteLength": len(part)}
            for start, part in zip(starts, parts, strict=False)
        ],
        "buffers": [{"byteLength": starts[-1]}],
    }
    if picture:
        head["images"] = [{"bufferView": len(arrays), "mimeType": "image/jpeg"}]
        head["samplers"] = [{"wrapS": _CLAMP, "wrapT": _CLAMP}]
        head["textures"] = [{"source": 0, "sampler": 0}]
        head["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"] = {"index": 0}
    text = json.dumps(head).encode()
    text += b" " * (-len(text) % 4)
    body = struct.pack("<I4s", len(text), b"JSON") + text
    body += struct.pack("<I4s", starts[-1], b"BIN\0") + b"".join(blocks)
    return struct.pack("<4sII", b"glTF", 2, 12 + len(body)) + body


def _accessor(row: int, array: np.ndarray) -> dict[str, Any]:
    accessor: dict[str, Any] = {
        "bufferView": row,
        "componentType": _TYPES[array.dtype.str],
        "count": len(array),
    }
    accessor["type"] = "SCALAR" if array.ndim == 1 else f"VEC{array.shape[1]}"
    if array.dtype.str == "<u2" and array.ndim == 2:
        accessor["normalized"] = True
    if array.ndim == 2 and array.shape[1] == 3:
        accessor["min"], accessor["max"] = array.min(axis=0).tolist(), array.max(axis=0).tolist()
    return accessor


def _linear_light() -> np.ndarray:
    """Return (256,) uint16 linear intensities of the sRGB values 0 to 255 (IEC 61966-2-1)."""
    srgb = np.arange(256) / 255.0
    linear = np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)
    return np.rint(65535.0 * linear).astype("<u2")


_LINEAR = _linear_light()
