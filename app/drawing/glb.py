"""Meshes and lines as binary glTF that a browser gets and draws quickly, even without a graphics card.

All materials are unlit: the light is computed into the vertex colours beforehand. A software renderer would
spend most of a frame on viser's lighting and its ribbon lines.

Positions are 16-bit steps (``KHR_mesh_quantization``), at most 0.1 mm off in each coordinate; beyond extents
of 13 m they stay 32-bit floats. Vertices and triangles follow a walk over the mesh (``ordering.py``), so that
``packing.py`` finds small differences.
"""

from __future__ import annotations

import json
import struct
from dataclasses import dataclass
from typing import Any

import numpy as np

from app.drawing.ordering import reordered
from pipeline.types import ByteArray, FloatArray, IntArray

STEP_M = 2e-4
"""Step of the positions; finer for objects whose sides are shorter than ``FEWEST_STEPS`` of them."""
FEWEST_STEPS, MOST_STEPS = 1 << 14, (1 << 16) - 1
"""Steps along the longest side of the box."""
UV_STEPS, UV_STEP_PX = 65535, 0.2
"""Steps of texture coordinates along a picture, of which only multiples of this length are used."""
GENERATOR = "PacketMesh"
_TYPES = {"<f4": 5126, "<u2": 5123, "<u4": 5125}
_LINES, _TRIANGLES = 1, 4
_CLAMP = 33071
_UNLIT, _QUANTIZED, _WEBP = "KHR_materials_unlit", "KHR_mesh_quantization", "EXT_texture_webp"
_VERTICES, _INDICES = 34962, 34963


def mesh_glb(vertices_m: FloatArray, triangles: IntArray, colors: ByteArray) -> bytes:
    """Return a glTF of (V, 3) vertices, (F, 3) counterclockwise triangles, (V, 3) sRGB; empty if F is 0."""
    if not len(triangles):
        return b""
    order, faces = reordered(vertices_m, triangles)
    return in_this_order(Places.of(vertices_m[order]), faces, colors[order])


def in_this_order(places: Places, triangles: IntArray, colors: ByteArray) -> bytes:
    """Return what ``mesh_glb`` returns, with vertices and triangles in their order; F is at least 1."""
    indices = _indices(triangles, len(colors))
    return _glb(_TRIANGLES, places, {"COLOR_0": _light(colors)}, indices=indices)


def textured_glb(
    vertices_m: FloatArray,
    triangles: IntArray,
    colors: ByteArray,
    uv: FloatArray,
    picture: bytes,
    side_px: int,
) -> bytes:
    """Return a mesh textured with a picture times its vertex colours; empty if it has no triangle.

    Texture coordinates are at most a tenth of a pixel off.

    Args:
        vertices_m: (V, 3) vertices.
        triangles: (F, 3) vertex indices, counterclockwise seen from the front.
        colors: (V, 3) sRGB by which the picture is multiplied.
        uv: (V, 2) texture coordinates, 0 to 1, from the picture's upper left corner.
        picture: a WebP file.
        side_px: its longer side.
    """
    if not len(triangles):
        return b""
    order, faces = reordered(vertices_m, triangles)
    places = Places.of(vertices_m[order])
    unit = max(int(UV_STEP_PX * UV_STEPS / side_px), 1)
    most = UV_STEPS // unit
    worn = (unit * np.clip(np.rint(UV_STEPS / unit * uv[order]), 0, most)).astype("<u2")
    attributes = {"COLOR_0": _light(colors[order]), "TEXCOORD_0": worn}
    return _glb(_TRIANGLES, places, attributes, indices=_indices(faces, len(order)), picture=picture)


def lines_glb(segments_m: FloatArray, color: tuple[int, int, int]) -> bytes:
    """Return a glTF of (E, 2, 3) line segments in an sRGB colour, one pixel wide; empty without segments.

    Segments that follow each other, end to start, take the fewest bytes.
    """
    if not len(segments_m):
        return b""
    red, green, blue = (LINEAR[list(color)] / 65535.0).tolist()
    points_m = segments_m.reshape(-1, 3)
    _, first, which = np.unique(points_m, axis=0, return_index=True, return_inverse=True)
    order = np.argsort(first)
    indices = _indices(np.argsort(order)[which.reshape(-1)], len(first))
    return _glb(_LINES, Places.of(points_m[first[order]]), {}, (red, green, blue), indices)


@dataclass(frozen=True, slots=True)
class Places:
    """Positions of vertices as a glTF holds them."""

    steps: np.ndarray
    """(V, 4) uint16 steps, the last column 0 (glTF aligns vertices to 4 bytes); or (V, 3) float32 metres."""
    low_m: list[float]
    step_m: float

    @staticmethod
    def of(points_m: FloatArray) -> Places:
        """Return (V, 3) points, V at least 1, in steps from the lower corner of their box."""
        points_m = points_m.astype(np.float64)
        low_m = points_m.min(axis=0)
        side_m = float((points_m.max(axis=0) - low_m).max())
        step_m = max(min(STEP_M, side_m / FEWEST_STEPS), 1e-9)
        if not side_m / step_m <= MOST_STEPS:
            return Places(points_m.astype("<f4"), [0.0, 0.0, 0.0], 1.0)
        steps = np.zeros((len(points_m), 4), "<u2")
        steps[:, :3] = np.rint((points_m - low_m) / step_m)
        return Places(steps, low_m.tolist(), step_m)

    @property
    def quantized(self) -> bool:
        """Whether the steps are integers, not 32-bit floats in metres."""
        return self.steps.dtype.kind == "u"


@dataclass(frozen=True, slots=True)
class Parts:
    """A binary glTF, taken apart; all but ``of`` and ``is_own`` are for those that this module wrote."""

    head: dict[str, Any]
    body: bytes

    @staticmethod
    def of(glb: bytes) -> Parts:
        (size,) = struct.unpack_from("<I", glb, 12)
        return Parts(json.loads(glb[20 : 20 + size]), glb[28 + size :])

    @property
    def is_own(self) -> bool:
        """Whether this module wrote it."""
        return bool(self.head.get("asset", {}).get("generator") == GENERATOR)

    @property
    def primitive(self) -> dict[str, Any]:
        """Its only primitive."""
        (primitive,) = self.head["meshes"][0]["primitives"]
        return dict(primitive)

    @property
    def vertices(self) -> int:
        """Number of its vertices."""
        return int(self.head["accessors"][self.primitive["attributes"]["POSITION"]]["count"])

    @property
    def triangles(self) -> IntArray | None:
        """(F, 3) indices of its triangles; None if it is of lines."""
        if self.primitive["mode"] != _TRIANGLES:
            return None
        return self.array(self.primitive["indices"]).reshape(-1, 3).astype(np.int64)

    def data(self, view: int) -> bytes:
        """Return the bytes of a buffer view."""
        where = self.head["bufferViews"][view]
        return self.body[where["byteOffset"] : where["byteOffset"] + where["byteLength"]]

    def array(self, row: int) -> np.ndarray:
        """Return an accessor's numbers, (N,) or (N, columns)."""
        accessor = self.head["accessors"][row]
        kind = next(kind for kind, number in _TYPES.items() if number == accessor["componentType"])
        numbers = np.frombuffer(self.data(accessor["bufferView"]), kind)
        if accessor["type"] == "SCALAR":
            return numbers
        return numbers.reshape(accessor["count"], -1)[:, : int(accessor["type"][-1])]


def _light(colors: ByteArray) -> np.ndarray:
    """Return (V, 4) uint16 linear RGB and opacity of (V, 3) sRGB, as glTF requires."""
    rgba = np.full((len(colors), 4), 65535, dtype="<u2")
    rgba[:, :3] = LINEAR[colors]
    return rgba


def _indices(triangles: IntArray, vertices: int) -> np.ndarray:
    return triangles.astype("<u2" if vertices < 65535 else "<u4").reshape(-1)


def _glb(
    mode: int,
    places: Places,
    attributes: dict[str, np.ndarray],
    linear_rgb: tuple[float, float, float] = (1.0, 1.0, 1.0),
    indices: np.ndarray | None = None,
    picture: bytes = b"",
) -> bytes:
    """Return a glTF of one primitive with one material, which may have a WebP texture."""
    attributes = {"POSITION": places.steps, **attributes}
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
    node: dict[str, Any] = {"mesh": 0}
    if places.quantized:
        node |= {"translation": places.low_m, "scale": [places.step_m] * 3}
    material: dict[str, Any] = {
        "pbrMetallicRoughness": {"baseColorFactor": [*linear_rgb, 1.0]},
        "extensions": {_UNLIT: {}},
    }
    views: list[dict[str, Any]] = [
        {"buffer": 0, "byteOffset": start, "byteLength": len(part)}
        for start, part in zip(starts, parts, strict=False)
    ]
    for row, array in enumerate(arrays):
        views[row]["target"] = _VERTICES if row < len(attributes) else _INDICES
        if row < len(attributes):
            views[row]["byteStride"] = array.strides[0]
    head: dict[str, Any] = {
        "asset": {"version": "2.0", "generator": GENERATOR},
        "extensionsUsed": [_UNLIT],
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [node],
        "meshes": [{"primitives": [primitive]}],
        "materials": [material],
        "accessors": [_accessor(row, array, row == 0) for row, array in enumerate(arrays)],
        "bufferViews": views,
        "buffers": [{"byteLength": starts[-1]}],
    }
    needed = [_QUANTIZED] if places.quantized else []
    if picture:
        needed.append(_WEBP)
        head["images"] = [{"bufferView": len(arrays), "mimeType": "image/webp"}]
        head["samplers"] = [{"wrapS": _CLAMP, "wrapT": _CLAMP}]
        head["textures"] = [{"sampler": 0, "extensions": {_WEBP: {"source": 0}}}]
        material["pbrMetallicRoughness"]["baseColorTexture"] = {"index": 0}
    if needed:
        head["extensionsUsed"] += needed
        head["extensionsRequired"] = needed
    text = json.dumps(head).encode()
    text += b" " * (-len(text) % 4)
    body = struct.pack("<I4s", len(text), b"JSON") + text
    body += struct.pack("<I4s", starts[-1], b"BIN\0") + b"".join(blocks)
    return struct.pack("<4sII", b"glTF", 2, 12 + len(body)) + body


def _accessor(row: int, array: np.ndarray, position: bool) -> dict[str, Any]:
    columns = 1 if array.ndim == 1 else 3 if position else array.shape[1]
    accessor: dict[str, Any] = {
        "bufferView": row,
        "componentType": _TYPES[array.dtype.str],
        "count": len(array),
        "type": "SCALAR" if columns == 1 else f"VEC{columns}",
    }
    if position:
        seen = array[:, :3]
        accessor["min"], accessor["max"] = seen.min(axis=0).tolist(), seen.max(axis=0).tolist()
    elif columns > 1:
        accessor["normalized"] = True
    return accessor


def _linear_light() -> np.ndarray:
    """Return (256,) uint16 linear intensities of the sRGB values 0 to 255 (IEC 61966-2-1)."""
    srgb = np.arange(256) / 255.0
    linear = np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)
    return np.rint(65535.0 * linear).astype("<u2")


LINEAR = _linear_light()
