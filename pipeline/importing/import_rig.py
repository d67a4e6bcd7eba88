"""From a recording to a rig folder."""

from __future__ import annotations

import secrets
import shutil
from collections.abc import Generator, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from packetmesh.errors import InputError
from packetmesh.progress import Progress
from pipeline.geometry import rigid
from pipeline.importing.choosing import choose
from pipeline.importing.depth_units import depth_in, scale_note
from pipeline.importing.kinds import recognise
from pipeline.importing.sequence import Candidate, Sequence
from pipeline.io.calibrations import FILES
from pipeline.io.extrinsics import write_extrinsics
from pipeline.io.images import read_color, write_color, write_depth_mm
from pipeline.io.intrinsics import write_intrinsics
from pipeline.io.poses import write_pose
from pipeline.io.rigs import MAX_NODES
from pipeline.types import AnyPath, CameraIntrinsics, FloatArray

MOST_TILT_DEG = 35.0
"""Of the cameras' mean upward direction from the world's; more is another world, which is turned."""


@dataclass(frozen=True, slots=True)
class ImportedFrame:
    """One frame of a recording that became a node."""

    node: str
    color: str
    depth: str
    time_s: float | None
    median_depth_m: float


@dataclass(frozen=True, slots=True)
class ImportReport:
    """What was found, what was taken, and what had to be assumed."""

    kind: str
    folder: str
    candidates: int
    """Frames of the recording that were looked at."""
    depth_scale: float
    """Depth units in a metre that were used."""
    frames: tuple[ImportedFrame, ...]
    notes: tuple[str, ...]
    """One sentence each."""


def iterate_import(
    path: AnyPath,
    out: AnyPath,
    frames: int = 3,
    depth_scale: float | None = None,
    intrinsics: AnyPath | None = None,
) -> Generator[Progress, None, ImportReport]:
    """Write a few frames of another program's recording as a rig folder, all of it or nothing.

    Args:
        path: the recording's folder, or one that holds nothing else.
        out: the rig's folder, new or empty.
        frames: how many nodes the rig gets, 1 to 6; fewer where the recording has no more that overlap.
        depth_scale: depth units in a metre; without it what the kind of recording uses.
        intrinsics: of the colour camera; without it those beside the images, or the kind's own.

    Raises:
        InputError: no recording, one that cannot be used, or a folder that cannot be written.
    """
    if not 1 <= frames <= MAX_NODES:
        raise InputError(f"A rig of {frames} frames cannot be; try 1 to {MAX_NODES}")
    if depth_scale is not None and not (np.isfinite(depth_scale) and depth_scale > 0):
        raise InputError(f"The depth scale is {depth_scale}; try 1000 for images in millimetres")
    out = Path(out)
    if out.exists() and not (out.is_dir() and not any(out.iterdir())):
        raise InputError(f"{out} is there already; try another name for the rig")
    kind, folder = recognise(Path(path))
    yield Progress("files", 0.0)
    sequence = kind.read(folder, None if intrinsics is None else Path(intrinsics))
    if depth_scale is not None:
        sequence = replace(sequence, units_per_metre=depth_scale, rotated_bits=False)
    yield Progress("choice of frames", 0.2)
    middle = depth_in(sequence.candidates[len(sequence.candidates) // 2].depth, sequence)
    chosen = choose(sequence, frames, middle.median_m)
    written = []
    with _new_folder(out) as folder_of_rig:
        T_up_world = _upright([sequence.candidates[index] for index in chosen])
        for done, index in enumerate(chosen):
            yield Progress("images", 0.3 + 0.7 * done / len(chosen))
            node = folder_of_rig / f"node_{done:02d}"
            written.append(_write_node(node, sequence.candidates[index], sequence, T_up_world))
    notes = [*sequence.notes, *middle.notes]
    if T_up_world is not None:
        notes.append("The world was turned so that z is up")
    if len(chosen) < min(frames, len(sequence.candidates)):
        notes.append(f"No more than {len(chosen)} of the frames overlap by half")
    notes += scale_note([frame.median_depth_m for frame in written], middle.units_per_metre)
    return ImportReport(
        kind.name,
        str(folder),
        len(sequence.candidates),
        middle.units_per_metre,
        tuple(written),
        tuple(notes),
    )


@contextmanager
def _new_folder(out: Path) -> Iterator[Path]:
    """A sibling that becomes ``out`` if the body succeeds and vanishes if not."""
    sibling = out.with_name(f".{out.name}-{secrets.token_hex(4)}")
    try:
        sibling.mkdir(parents=True)
        yield sibling
        if out.is_dir():
            out.rmdir()
        sibling.rename(out)
    except OSError as error:
        raise InputError(
            f"{out} cannot be written ({error.strerror or error}); try another folder for the rig"
        ) from None
    finally:
        shutil.rmtree(sibling, ignore_errors=True)


def _write_node(
    node: Path, candidate: Candidate, sequence: Sequence, T_up_world: FloatArray | None
) -> ImportedFrame:
    rgb, read = read_color(candidate.color), depth_in(candidate.depth, sequence)
    _check_size(rgb.shape, sequence.camera, candidate.color, "colour")
    depth_camera = sequence.depth_camera
    if depth_camera is None and read.depth.z_m.shape != rgb.shape[:2]:
        height_px, width_px = read.depth.z_m.shape
        raise InputError(
            f"{candidate.depth} has {width_px} x {height_px} pixels but {candidate.color} has "
            f"{rgb.shape[1]} x {rgb.shape[0]}; try a recording whose depth is registered to the colour images"
        )
    write_color(node / "color.png", rgb)
    write_depth_mm(node / "depth.png", read.depth)
    write_intrinsics(node / "intrinsics.json", sequence.camera)
    if depth_camera is not None and sequence.T_color_depth is not None:
        _check_size(read.depth.z_m.shape, depth_camera, candidate.depth, "depth")
        write_intrinsics(node / FILES["depth_intrinsics"], depth_camera)
        write_extrinsics(node / FILES["extrinsics"], sequence.T_color_depth)
    if candidate.T_world_camera is not None:
        T = candidate.T_world_camera
        write_pose(node / "pose.txt", T if T_up_world is None else T_up_world @ T)
    paths = str(candidate.color), str(candidate.depth)
    return ImportedFrame(node.name, *paths, candidate.time_s, read.median_m)


def _check_size(shape: tuple[int, ...], camera: CameraIntrinsics, path: Path, what: str) -> None:
    if shape[:2] != (camera.height_px, camera.width_px):
        raise InputError(
            f"The {what} image {path} has {shape[1]} x {shape[0]} pixels, others of the recording "
            f"{camera.width_px} x {camera.height_px}; try a recording of one camera"
        )


def _upright(candidates: list[Candidate]) -> FloatArray | None:
    """The turn that makes the cameras' mean upward direction +z; None where the world's z is up as it is.

    Many recordings have the first camera's axes as the world's; a rig's world has z up.
    """
    poses = [candidate.T_world_camera for candidate in candidates if candidate.T_world_camera is not None]
    if not poses:
        return None
    up = -np.mean([T[:3, 1] for T in poses], axis=0)
    if up[2] >= np.cos(np.deg2rad(MOST_TILT_DEG)) * np.linalg.norm(up):
        return None
    turn, _ = Rotation.align_vectors([[0.0, 0.0, 1.0]], [up])
    return rigid(turn.as_matrix(), np.zeros(3))
