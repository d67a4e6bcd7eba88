"""Furniture catalogues of Sweet Home 3D: hundreds of free models with true sizes, and images for surfaces.

Debian's package ``sweethome3d-furniture`` brings 820 models (public domain and CC BY 3.0); ``sweethome3d``
brings photographs of floors and walls.
"""

from __future__ import annotations

import hashlib
import re
import tempfile
import zipfile
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Literal

import numpy as np

from lab.training.archives import numbered_records, zip_files
from lab.training.models import Model, load_model, make_model, save_model
from lab.training.wavefront import decode_image, read_wavefront
from packetmesh.errors import InputError
from pipeline.types import ByteArray, FloatArray

Role = Literal["opening", "ceiling", "wall", "against", "table", "chair", "free", "small", "unused"]
"""Place of an object, such as in a wall (opening), against a wall, or on the floor or furniture (small)."""
_FORMAT = 2
"""Version of the cached models; after a change all models are made again."""
_OUTDOORS = re.compile(
    r"\b(sedan|elevator|garage|shutter|blind|screen door|street|lamppost|fences?|railing|hedge|goal|horse|"
    r"hut|chimney|swimming|diving|snowman|motorbike|swing|sandpit|light source|hydrant|fountain|fitness|net|"
    r"hanging clothes|mannequin male|shower door|wire coathanger)\b"
)
_TABLES = ("table", "desk", "nightstand", "commode", "chest of drawers", "sideboard", "counter", "workbench")
_CHAIRS = ("chair", "stool", "pouf", "ottoman")
OTHER_AUTHORS = {"validation": ("katorlegaz",), "test": ("blendswap-cc-by",)}
"""Values of ``Entry.author`` whose models furnish the rooms of that split only."""
_HUNG = ("picture", "painting", "poster", "frame", "mirror", "clock", "board")


@dataclass(frozen=True, slots=True)
class Entry:
    """One model of a catalogue, not yet read."""

    name: str
    category: str
    size_m: FloatArray
    """(3,) width, depth and height of the object."""
    elevation_m: float
    """Height of its lowest point above the floor."""
    rotation: FloatArray
    """(3, 3) rotation of the model in its own frame."""
    light_m: FloatArray | None
    """(3,) position of a lamp's light in the piece's frame (Z up, from the middle of its foot), or None."""
    file: Path
    """Zip file of the catalogue."""
    model: str
    """Path of the OBJ model in ``file``."""
    role: Role

    @property
    def author(self) -> str:
        """The archive's top folder of the model, named after a contributor or a collection."""
        return self.model.partition("/")[0]

    @property
    def key(self) -> str:
        """Name of the model in the cache."""
        light_m = None if self.light_m is None else self.light_m.tolist()
        shape = f"{self.size_m.tolist()} {self.rotation.tolist()} {light_m}"
        text = f"{_FORMAT} {self.file.name} {self.model} {shape}"
        return hashlib.sha256(text.encode()).hexdigest()[:20]


@dataclass(frozen=True, slots=True)
class SurfaceImage:
    """A photograph that is repeated over floors or walls."""

    category: str
    size_m: tuple[float, float]
    """True width and height of the photographed area."""
    rgba: ByteArray
    """(H, W, 4)."""


@dataclass(frozen=True, slots=True)
class Catalogue:
    """A catalogue of furniture for rooms; its models are converted when needed and kept in ``cache``."""

    entries: tuple[Entry, ...]
    images: tuple[SurfaceImage, ...]
    cache: Path

    @classmethod
    def open(cls, source: Path | str, cache: Path | str | None = None) -> Catalogue:
        """List the content of a folder, a Debian package or a ``.sh3f`` file.

        Args:
            source: for example ``/usr/share/sweethome3d``, or a folder with both packages.
            cache: folder for prepared models; None uses one in the system's temporary folder.

        Raises:
            InputError: ``source`` holds no furniture.
        """
        folder = Path(cache) if cache else Path(tempfile.gettempdir()) / "packetmesh-furniture"
        (folder / "models").mkdir(parents=True, exist_ok=True)
        entries: list[Entry] = []
        images: list[SurfaceImage] = []
        for file in zip_files(Path(source), folder):
            records = numbered_records(file, "FurnitureCatalog.properties")
            entries += [_entry(record, file) for record in records]
            images += _images(file)
        if not entries:
            raise InputError(
                f"'{source}' holds no FurnitureCatalog.properties; name sweethome3d's furniture."
            )
        return cls(tuple(entries), tuple(images), folder)

    def of_split(self, split: str) -> Catalogue:
        """Return the part of the catalogue for a split; no ``Entry.author`` is in two splits.

        Raises:
            InputError: the catalogue has no model for the split.
        """
        other = OTHER_AUTHORS.get(split, ())
        away = tuple(name for names in OTHER_AUTHORS.values() for name in names)
        entries = tuple(e for e in self.entries if (e.author in other if other else e.author not in away))
        if not entries:
            raise InputError(
                f"The furniture holds none by {' or '.join(other) or 'the authors for training'}, which "
                f"{split} rooms are furnished from: name all of sweethome3d-furniture."
            )
        return replace(self, entries=entries)

    def of_role(self, role: Role) -> tuple[Entry, ...]:
        """Return the entries for one kind of place."""
        return tuple(entry for entry in self.entries if entry.role == role)

    def model(self, entry: Entry) -> Model:
        """Return the model of an entry, from memory, from the cache, or made now.

        Raises:
            InputError: the file lacks the model, or the model has no triangles.
        """
        file = self.cache / "models" / f"{entry.key}.npz"
        if not file.exists():
            with zipfile.ZipFile(entry.file) as archive:
                mesh = read_wavefront(archive, entry.model)
            save_model(make_model(mesh, entry.rotation, entry.size_m, entry.light_m), file)
        return _kept(file)


_kept = lru_cache(maxsize=400)(load_model)
"""Keeps recently read models in memory."""


def _entry(record: dict[str, str], file: Path) -> Entry:
    """Return the entry of a catalogue's record, whose lengths are in centimetres."""
    try:
        size_m = np.array([float(record[key]) for key in ("width", "depth", "height")]) / 100.0
        elevation_m = float(record.get("elevation", 0.0)) / 100.0
        turn = np.array(record.get("modelRotation", "1 0 0 0 1 0 0 0 1").split(), float).reshape(3, 3)
        name, model = record["name"], record["model"].lstrip("/")
        light_m = _light(record, size_m)
    except (KeyError, ValueError) as error:
        text = f"A record of '{file}' is incomplete ({error}); download the catalogue again."
        raise InputError(text) from None
    category, opening = record.get("category", ""), record.get("doorOrWindow") == "true"
    role = _role(name.lower(), category, size_m, elevation_m, opening)
    return Entry(
        name,
        category,
        size_m,
        elevation_m,
        turn,
        light_m,
        file,
        model,
        role,
    )


def _light(record: dict[str, str], size_m: FloatArray) -> FloatArray | None:
    """Return a record's first light position, (3,) or None; the catalogue's origin is back left."""
    if "lightSourceX" not in record:
        return None
    x, y, z = (float(record[f"lightSource{axis}"].split()[0]) / 100.0 for axis in "XYZ")
    return np.array([x - 0.5 * size_m[0], 0.5 * size_m[1] - y, z])


def _role(name: str, category: str, size_m: FloatArray, elevation_m: float, opening: bool) -> Role:
    """Return the place of an object, by its name, category, size and elevation."""
    width, depth, height = size_m
    longest = float(size_m.max())
    if category in ("Vehicles", "Staircases") or _OUTDOORS.search(name):
        return "unused"
    if (category == "Exterior" and longest > 2.0) or longest > 2.6 or size_m.min() <= 0.0:
        return "unused"
    if category == "Characters" and any(word in name for word in ("sit", "lying", "hold")):
        return "unused"
    if opening or category == "Doors and windows":
        return "opening"
    if elevation_m > 1.2 and (category == "Lights" or "ceiling" in name):
        return "wall" if any(word in name for word in ("wall", "porch", "outdoor")) else "ceiling"
    if elevation_m > 0.2 or (depth < 0.12 and height > 0.25 and any(word in name for word in _HUNG)):
        return "wall" if depth < 0.7 else "unused"
    if longest < 0.45 or (category == "Lights" and height < 0.9):
        return "small"
    if any(word in name for word in _TABLES):
        return "table"
    if any(word in name for word in _CHAIRS):
        return "chair"
    return "against" if height > 0.35 and width > 0.4 and category in _ROOMS else "free"


_ROOMS = ("Living room", "Bedroom", "Kitchen", "Bathroom", "Office")


def _images(file: Path) -> list[SurfaceImage]:
    """Return the photographs of floors and walls in a zip file."""
    images = []
    with zipfile.ZipFile(file) as archive:
        for record in numbered_records(file, "TexturesCatalog.properties"):
            path = record.get("image", "").lstrip("/")
            rgba = decode_image(archive.read(path)) if path in archive.namelist() else None
            if rgba is not None and {"width", "height"} <= record.keys():
                size_m = float(record["width"]) / 100.0, float(record["height"]) / 100.0
                images.append(SurfaceImage(record.get("category", ""), size_m, rgba))
    return images
