"""What every kind of recording is read into."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

from packetmesh.errors import InputError
from packetmesh.files import path_below
from pipeline.kernels.geometry import rigid
from pipeline.types import CameraIntrinsics, FloatArray

DEPTH_SUFFIXES = (".png", ".tif", ".tiff", ".npy", ".pfm", ".exr", ".pgm")
"""Of depth images."""


@dataclass(frozen=True, slots=True)
class Candidate:
    """A colour and a depth image of one moment, not read yet."""

    color: Path
    depth: Path
    T_world_camera: FloatArray | None = None
    """(4, 4) of the colour camera, metres."""
    time_s: float | None = None

    def enlarged(self, factor: float) -> Candidate:
        """With its pose's lengths times ``factor``."""
        T = self.T_world_camera
        return self if T is None else replace(self, T_world_camera=rigid(T[:3, :3], factor * T[:3, 3]))


@dataclass(frozen=True, slots=True)
class Sequence:
    """The frames of one recording, in the order of time, with what they have in common."""

    candidates: tuple[Candidate, ...]
    """All of them with poses or none."""
    camera: CameraIntrinsics
    units_per_metre: float = 1000.0
    """Of depth images in whole numbers, or of all if it is stated."""
    scale_stated: bool = False
    """Whether a person gave it."""
    rotated_bits: bool = False
    """Whether the depth images may have their bits rotated as those of SUN RGB-D."""
    depth_camera: CameraIntrinsics | None = None
    """Of depth images that are not registered to the colour images."""
    T_color_depth: FloatArray | None = None
    """(4, 4) where that camera stands, metres."""
    poses_in_depth_units: bool = False
    """Whether the poses are known in the unit of the depth images only, as those of COLMAP."""
    notes: tuple[str, ...] = ()
    """What was assumed, one sentence each."""

    def with_scale(self, units_per_metre: float) -> Sequence:
        """With depth images of so many units in a metre."""
        candidates = self.candidates
        if self.poses_in_depth_units:
            factor = self.units_per_metre / units_per_metre
            candidates = tuple(candidate.enlarged(factor) for candidate in candidates)
        return replace(
            self,
            rotated_bits=False,
            candidates=candidates,
            units_per_metre=units_per_metre,
            scale_stated=True,
        )


def named_inside(folder: Path, name: str, file: str) -> Path:
    """What a file of a recording calls ``name``.

    Raises:
        InputError: it lies outside the recording's folder.
    """
    try:
        return path_below(folder, name)
    except InputError:
        raise InputError(f"{file} in {folder} names {name}, which is outside; check the file") from None


def posed(candidates: list[Candidate], what: str) -> tuple[tuple[Candidate, ...], tuple[str, ...]]:
    """Those with a pose and a note on what was left out; all of them if none has one."""
    known = [candidate for candidate in candidates if candidate.T_world_camera is not None]
    if not known:
        note = f"No {what}: poses are not known; reconstruct looks for them"
        return tuple(candidates), (note,)
    lost = len(candidates) - len(known)
    note = f"{lost} of {len(candidates)} frames have no pose and were left out"
    return tuple(known), (note,) if lost else ()
