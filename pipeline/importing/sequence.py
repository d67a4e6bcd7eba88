"""Frames of a recording, the common form into which the reader of every kind converts it."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path

from packetmesh.errors import InputError
from packetmesh.files import path_below
from pipeline.importing.found_poses import FoundPoses
from pipeline.importing.stored import AnyImage, exists
from pipeline.io.poses import rounding_note
from pipeline.kernels.geometry import rigid
from pipeline.types import CameraIntrinsics, FloatArray

DEPTH_SUFFIXES = (".png", ".tif", ".tiff", ".npy", ".pfm", ".exr", ".pgm")
"""File name suffixes of depth images."""
SAME_VIEW_REMEDY = "try a recording whose depth shows the view of its colour images"
"""Remedy in the error for depth that is not in proportion to colour."""


@dataclass(frozen=True, slots=True)
class Candidate:
    """A colour and a depth image of one moment, with the pose."""

    color: AnyImage
    depth: AnyImage
    T_world_camera: FloatArray | None = None
    """(4, 4) pose of the colour camera, metres; None if it is unknown."""
    time_s: float | None = None
    camera: CameraIntrinsics | None = None
    """Colour camera of this moment; None takes ``Sequence.camera``."""
    confidence: AnyImage | None = None
    """Image of the depth image's size: 0 where the sensor has low confidence in its depth, larger values for
    more, up to ``Sequence.highest_confidence``."""

    def enlarged(self, factor: float) -> Candidate:
        """Return the candidate with its position multiplied by ``factor``."""
        T = self.T_world_camera
        return self if T is None else replace(self, T_world_camera=rigid(T[:3, :3], factor * T[:3, 3]))


def _unchanged(sequence: Sequence) -> Sequence:
    return sequence


@dataclass(frozen=True, slots=True)
class Sequence:
    """The frames of one recording in order of time, with their common properties."""

    candidates: tuple[Candidate, ...]
    """Candidates; some may lack a pose (``only_posed``)."""
    camera: CameraIntrinsics
    units_per_metre: float = 1000.0
    """Depth units per metre of integer images and COLMAP's maps, or of all images if ``scale_stated``."""
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
    highest_confidence: int = 2
    """Value of confidence images where the sensor has high confidence; 2 is ARKit's."""
    without_poses: str = ""
    """Note on a recording without any pose; empty if it has one, or if ``notes`` has the reason."""
    notes: tuple[str, ...] = ()
    """Assumptions, one sentence each."""
    completed: Callable[[Sequence], Sequence] = field(default=_unchanged, compare=False, repr=False)
    """Returns the sequence with the notes and poses that depend on the depth scale; called when it is
    known."""

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

    def only_posed(self) -> Sequence:
        """Return the sequence without the frames that lack a pose, and a note; itself if no frame has one."""
        known = tuple(one for one in self.candidates if one.T_world_camera is not None)
        if len(known) in (0, len(self.candidates)):
            return self
        note = left_out_note(len(self.candidates) - len(known), "frame", "without a pose")
        return replace(self, candidates=known, notes=(*self.notes, *note))


def left_out_note(count: int, noun: str, which: str) -> tuple[str, ...]:
    """Return a sentence on how many frames, moments or others (``noun``) were left out, if any."""
    if not count:
        return ()
    return (f"1 {noun} {which} was left out" if count == 1 else f"{count} {noun}s {which} were left out",)


def named_inside(folder: Path, name: str, file: str) -> Path:
    """Return the path in ``folder`` of a name that ``file`` contains, with the separators of any system.

    Raises:
        InputError: it is outside the recording's folder.
    """
    with suppress(ValueError):  # absolute, but inside
        name = Path(name).relative_to(folder.resolve()).as_posix()
    if "\\" in name and not (folder / name).is_file():
        name = name.replace("\\", "/")
    try:
        return path_below(folder, name)
    except InputError:
        raise InputError(
            f"{file} in {folder} names {name}, which is outside this folder; try names such as rgb/0.png, "
            "from this folder on"
        ) from None


def existing(candidates: list[Candidate], lists: str, remedy: str) -> tuple[list[Candidate], tuple[str, ...]]:
    """Return the candidates whose two images exist, and a note if some do not.

    Args:
        candidates: the frames that the files of a recording name.
        lists: names of these files.
        remedy: what to try if none exists.

    Raises:
        InputError: none exists.
    """
    missing = [image for own in candidates for image in (own.color, own.depth) if not exists(image)]
    if not missing:
        return candidates, ()
    kept = [own for own in candidates if exists(own.color) and exists(own.depth)]
    if not kept:
        raise InputError(f"No two images that {lists} names together exist, such as {missing[0]}; {remedy}")
    return kept, (
        f"{len(candidates) - len(kept)} of {len(candidates)} frames of {lists} lack an image, such as "
        f"{missing[0]}, and were left out",
    )


def distinct(candidates: tuple[Candidate, ...]) -> tuple[tuple[Candidate, ...], tuple[str, ...]]:
    """Return the candidates without those of a moment that an earlier one already has, and a note.

    It is the same moment if the colour or the depth image is the same, or the time.
    """
    seen: set[AnyImage] = set()
    times_s: set[float] = set()
    found = []
    again = repeated = 0
    for candidate in candidates:
        if seen & {candidate.color, candidate.depth}:
            again += 1
            continue
        if candidate.time_s in times_s:
            repeated += 1
            continue
        found.append(candidate)
        seen |= {candidate.color, candidate.depth}
        if candidate.time_s is not None:
            times_s.add(candidate.time_s)
    notes = []
    if again:
        names, were = ("1 frame names", "was") if again == 1 else (f"{again} frames name", "were")
        notes.append(f"{names} an image that an earlier frame has, and {were} left out")
    if repeated:
        notes.append(
            f"{repeated} frames have the time of another frame and were left out; each needs its own time"
        )
    return tuple(found), tuple(notes)


def posed(
    candidates: list[Candidate], what: str, poses: FoundPoses | None = None
) -> tuple[tuple[Candidate, ...], str, tuple[str, ...]]:
    """Return the candidates, ``Sequence.without_poses``, and notes on their poses.

    Args:
        candidates: the frames of a recording.
        what: description of the missing pose, for the note.
        poses: how the poses were read; None means that all that exist were usable.
    """
    refused, lost = (poses.refused, poses.lost) if poses else ((), 0)
    known = [candidate for candidate in candidates if candidate.T_world_camera is not None]
    if not known:
        unknown = "poses are not known; reconstruct looks for them"
        if refused:
            why = f"{refused[0]}{f' (and {len(refused) - 1} more)' if len(refused) > 1 else ''}"
        elif lost:
            why = f"Every {what} holds numbers that are not finite, as where tracking was lost"
        else:
            return tuple(candidates), f"No {what}: {unknown}", ()
        return tuple(candidates), "", (f"{why}: {unknown}",)
    without = len(candidates) - len(known)
    notes = []
    if without:
        why = f"; {refused[0]}" if refused else ""
        notes.append(f"{without} of {len(candidates)} frames have no pose{why}")
    if poses:
        notes += rounding_note("The rotation of a pose", poses.departure)
    return tuple(candidates), "", tuple(notes)
