"""Reader of OBJ models and MTL materials in a zip file."""

from __future__ import annotations

import zipfile
from collections.abc import Iterator
from dataclasses import dataclass, field
from posixpath import dirname, normpath
from posixpath import join as join_path

import cv2
import numpy as np

from packetmesh.errors import InputError
from pipeline.types import ByteArray, FloatArray, IntArray

_LARGEST_TEXTURE_PX = 512


@dataclass(slots=True)
class Finish:
    """One material of an MTL file; its colour as written there, sRGB from 0 to 1."""

    name: str = ""
    color: FloatArray = field(default_factory=lambda: np.full(3, 0.7))
    specular: float = 0.0
    shininess: float = 0.0
    opacity: float = 1.0
    image: ByteArray | None = None
    """(H, W, 4) RGBA texture, first row at v = 1; None if there is none."""


@dataclass(frozen=True, slots=True)
class Wavefront:
    """Triangles of an OBJ model, in its own frame and units."""

    vertices: FloatArray
    """(V, 3)."""
    triangles: IntArray
    """(F, 3) indices into ``vertices``."""
    uv: FloatArray
    """(F, 3, 2) texture coordinates of each triangle's corners; 0 where the model has none."""
    finish: IntArray
    """(F,) indices into ``finishes``."""
    finishes: tuple[Finish, ...]


def read_wavefront(archive: zipfile.ZipFile, path: str) -> Wavefront:
    """Read a model with its materials and textures; polygons are split into fans of triangles.

    Args:
        archive: holds the model and the files that it names.
        path: path of the ``.obj`` inside the archive.

    Raises:
        InputError: the model is missing or has no triangles.
    """
    try:
        lines = archive.read(path).decode("latin-1").splitlines()
    except KeyError:
        raise InputError(f"'{archive.filename}' lacks its model '{path}'; download it again.") from None
    vertices: list[list[str]] = []
    places: list[list[str]] = []
    corners: list[tuple[int, int]] = []
    finish_of: list[int] = []
    library: dict[str, Finish] = {}
    used: dict[str, int] = {}
    current = ""
    for line in lines:
        word, _, rest = line.strip().partition(" ")
        if word == "v":
            vertices.append(rest.split()[:3])
        elif word == "vt":
            places.append(rest.split()[:2])
        elif word == "f":
            fan = list(_fan(rest.split(), len(vertices), len(places)))
            corners += fan
            finish_of += [used.setdefault(current, len(used))] * (len(fan) // 3)
        elif word == "usemtl":
            current = rest.strip()
        elif word == "mtllib":
            library |= _read_library(archive, normpath(join_path(dirname(path), rest.strip())))
    if not finish_of:
        raise InputError(f"The model '{path}' in '{archive.filename}' has no triangles; leave it out.")
    index = np.array(corners, np.int64).reshape(-1, 3, 2)
    uv = np.array([place + ["0"] * (2 - len(place)) for place in places] + [["0", "0"]], float)
    finishes = tuple(library.get(name, Finish(name)) for name in used)
    return Wavefront(
        np.array(vertices, float), index[..., 0], uv[index[..., 1]], np.array(finish_of), finishes
    )


def _fan(words: list[str], vertices: int, places: int) -> Iterator[tuple[int, int]]:
    """Yield vertex and texture indices (-1 for none) of the corners of a polygon's triangles."""
    polygon = []
    for word in words:
        parts = word.split("/")
        v, t = int(parts[0]), int(parts[1]) if len(parts) > 1 and parts[1] else 0
        polygon.append((v - 1 if v > 0 else vertices + v, t - 1 if t >= 0 else places + t))
    for k in range(1, len(polygon) - 1):
        yield from (polygon[0], polygon[k], polygon[k + 1])


def _read_library(archive: zipfile.ZipFile, path: str) -> dict[str, Finish]:
    """Return the materials of an MTL file by name; none if the file is missing."""
    if path not in archive.namelist():
        return {}
    library: dict[str, Finish] = {}
    finish = Finish()
    for line in archive.read(path).decode("latin-1").splitlines():
        word, _, rest = line.strip().partition(" ")
        values = rest.split()
        if word == "newmtl":
            finish = library.setdefault(rest.strip(), Finish(rest.strip()))
        elif word == "Kd" and len(values) >= 3:
            finish.color = np.clip(np.array(values[:3], float), 0.0, 1.0)
        elif word == "Ks" and len(values) >= 3:
            finish.specular = float(np.mean(np.array(values[:3], float)))
        elif word == "Ns" and values:
            finish.shininess = float(values[0])
        elif word == "d" and values:
            finish.opacity = float(values[-1])
        elif word == "map_Kd" and values:
            image = normpath(join_path(dirname(path), rest.strip().replace("\\", "/")))
            finish.image = decode_image(archive.read(image)) if image in archive.namelist() else None
    return library


def decode_image(content: bytes) -> ByteArray | None:
    """Return (H, W, 4) RGBA of an image file, at most 512 x 512 pixels; None if unreadable or not 8-bit."""
    image = cv2.imdecode(np.frombuffer(content, np.uint8), cv2.IMREAD_UNCHANGED) if content else None
    if image is None or image.dtype != np.uint8:
        return None
    code = {2: cv2.COLOR_GRAY2RGBA, 3: cv2.COLOR_BGR2RGBA, 4: cv2.COLOR_BGRA2RGBA}
    image = cv2.cvtColor(image, code[2 if image.ndim == 2 else image.shape[2]])
    scale = _LARGEST_TEXTURE_PX / max(image.shape[:2])
    if scale < 1.0:
        image = cv2.resize(image, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
    return np.asarray(image, np.uint8)
