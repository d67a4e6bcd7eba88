"""Frames of a recording, the common form into which the reader of every kind converts it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

from packetmesh.errors import InputError
from packetmesh.files import path_below
from pipeline.kernels.geometry import rigid
from pipeline.types import CameraIntrinsics, FloatArray

DEPTH_SUFFIXES = (".png", ".tif", ".tiff", ".npy", ".pfm", ".exr", ".pgm")
"""File name suffixes of depth images."""


@dataclass(frozen=True, slots=True)
class Candidate:
    """File names of a colour and a depth image of one moment, with the pose."""

    color: Path
    depth: Path
    T_world_camera: FloatArray | None = None
    """(4, 4) pose of the colour camera, metres."""
    time_s: float | None = None

    def enlarged(self, factor: float) -> Candidate:
        """Return the candidate with its position multiplied by ``factor``."""
        T = self.T_world_camera
        return self if T is None else replace(self, T_world_camera=rigid(T[:3, :3], factor * T[:3, 3]))


@dataclass(frozen=True, slots=True)
class Sequence:
    """The frames of one recording in order of time, with their common properties."""

    candidates: tuple[Candidate, ...]
    """Candidates, either all with poses or all without."""
    camera: CameraIntrinsics
    units_per_metre: float = 1000.0
    """Depth units per metre of integer images, or of all images if ``scale_stated``."""
    scale_stated: bool = False
    """Whether the user gave the scale."""
    rotated_bits: bool = False
    """Whether depth images may have rotated bits, as in SUN RGB-D."""
    depth_camera: CameraIntrinsics | None = None
    """Depth camera, if depth images are not registered to colour images."""
    T_color_depth: FloatArray | None = None
    """(4, 4) pose of the depth camera in the colour camera's frame, metres."""
    poses_in_depth_units: bool = False
    """Whether the poses have the depth images' unknown unit, as in COLMAP."""
    notes: tuple[str, ...] = ()
    """Assumptions, one sentence each."""

    def with_scale(self, units_per_metre: float) -> Sequence:
        """Return the sequence with another depth scale."""
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
    """Return the path of ``name``, which a file of a recording contains.

    Raises:
        InputError: it is outside the recording's folder.
    """
    try:
        return path_below(folder, name)
    except InputError:
        raise InputError(f"{file} in {folder} names {name}, which is outside; check the file") from None


def posed(candidates: list[Candidate], what: str) -> tuple[tuple[Candidate, ...], tuple[str, ...]]:
    """Return the candidates with a pose and a note on those left out, or all if none has a pose."""
    known = [candidate for candidate in candidates if candidate.T_world_camera is not None]
    if not known:
        note = f"No {what}: poses are not known; reconstruct looks for them"
        return tuple(candidates), (note,)
    lost = len(candidates) - len(known)
    note = f"{lost} of {len(candidates)} frames have no pose and were left out"
    return tuple(known), (note,) if lost else ()
