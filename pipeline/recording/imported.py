"""Imports whose poses are compared with the depth before they are used."""

from __future__ import annotations

from collections.abc import Generator, Sequence

from packetmesh.progress import Progress
from pipeline.importing import ImportReport, KeptReport, iterate_import, iterate_keep
from pipeline.importing.recorded import BagRecording, FolderRecording
from pipeline.recording.given import checked_poses
from pipeline.types import AnyPath, FloatArray


def iterate_checked_import(
    path: AnyPath,
    out: AnyPath,
    frames: int = 3,
    depth_scale: float | None = None,
    intrinsics: AnyPath | None = None,
) -> Generator[Progress, None, ImportReport]:
    """Import a few frames as ``iterate_import``, with poses as ``checked_poses`` returns them."""
    return (yield from iterate_import(path, out, frames, depth_scale, intrinsics, _check))


def iterate_checked_keep(
    path: AnyPath, out: AnyPath, depth_scale: float | None = None, intrinsics: AnyPath | None = None
) -> Generator[Progress, None, KeptReport]:
    """Write all frames as ``iterate_keep``, with poses as ``checked_poses`` returns them."""
    return (yield from iterate_keep(path, out, depth_scale, intrinsics, _check))


def _check(
    recording: FolderRecording | BagRecording,
) -> tuple[Sequence[FloatArray | None] | None, tuple[str, ...]]:
    """Return the poses that agree with a recording's depth, None if none do, and notes."""
    given = checked_poses(recording)
    return given.T_world_camera, given.notes
