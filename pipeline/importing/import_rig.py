"""Import of a recording as a rig folder."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from packetmesh.errors import InputError
from packetmesh.progress import Progress, part
from pipeline.importing.bag import iterate_bag
from pipeline.importing.bag_reader import is_bag
from pipeline.importing.choosing import choose
from pipeline.importing.depth_units import depth_in
from pipeline.importing.kinds import kind_of
from pipeline.importing.reading import MOST_CANDIDATES, check_bag_intrinsics, check_scale, read_sequence
from pipeline.importing.recorded import Check, FolderRecording, first_depth
from pipeline.importing.rig_folder import NodeImages, check_new, new_folder, write_node
from pipeline.importing.sequence import SAME_VIEW_REMEDY, Candidate, Sequence, left_out_note
from pipeline.importing.stored import read_color_of
from pipeline.importing.upright import upright
from pipeline.io.images import NoDepthError, ReadDepth
from pipeline.io.same_view import depth_camera_of, same_view_note
from pipeline.types import MAX_NODES, AnyPath, FloatArray


@dataclass(frozen=True, slots=True)
class ImportedFrame:
    """A frame of a recording that became a node."""

    node: str
    color: str
    depth: str
    time_s: float | None
    median_depth_m: float

    @staticmethod
    def of(node: NodeImages, index: int, time_s: float | None) -> ImportedFrame:
        """Describe a node that was written."""
        median_m = float(np.nanmedian(node.depth.z_m))
        return ImportedFrame(f"node_{index:02d}", node.color_name, node.depth_name, time_s, median_m)


@dataclass(frozen=True, slots=True)
class ImportReport:
    """Result of an import: kind of recording, chosen frames, and assumptions."""

    kind: str
    folder: str
    candidates: int
    """Number of frames of the recording that were considered."""
    depth_scale: float | None
    """Depth units per metre that were used; None if the cameras of a bag have different ones."""
    frames: tuple[ImportedFrame, ...]
    notes: tuple[str, ...]
    """Notes, one sentence each."""


def is_recording(path: Path) -> bool:
    """Return whether ``iterate_import`` can read a path."""
    return is_bag(path) or kind_of(path) is not None


def iterate_import(
    path: AnyPath,
    out: AnyPath,
    frames: int = 3,
    depth_scale: float | None = None,
    intrinsics: AnyPath | None = None,
    check: Check | None = None,
) -> Generator[Progress, None, ImportReport]:
    """Import a few frames of another program's recording as a rig folder, completely or not at all.

    Args:
        path: the recording's folder or file, a bag, or a folder with only this recording.
        out: the rig's folder, new or empty.
        frames: number of nodes, 1 to ``MAX_NODES``; there are fewer nodes if fewer frames overlap.
        depth_scale: depth units per metre; by default that of the kind of recording.
        intrinsics: intrinsics file of the colour camera; by default the recording's, or those of its kind; a
            bag takes none.
        check: compares the poses with the depth before frames are chosen; None takes them as they are. The
            moments of a bag are chosen without it.

    Raises:
        InputError: the path is no usable recording, or the folder cannot be written.
    """
    if not 1 <= frames <= MAX_NODES:
        raise InputError(f"A rig cannot have {frames} nodes; try 1 to {MAX_NODES}")
    check_scale(depth_scale)
    out = Path(out)
    check_new(out)
    if is_bag(Path(path)):
        check_bag_intrinsics(Path(path), intrinsics)
        return (yield from _from_bag(Path(path), out, frames, depth_scale))
    yield Progress("files", 0.0)
    kind, folder, sequence = read_sequence(Path(path), depth_scale, intrinsics, MOST_CANDIDATES)
    if check is not None:
        yield Progress("poses", 0.1)
        sequence = _checked(FolderRecording(kind.name, folder, sequence), check)
    sequence = sequence.only_posed()
    yield Progress("choice of frames", 0.2)
    sequence, chosen, middle = _chosen(sequence, frames)
    written = []
    with new_folder(out) as folder_of_rig:
        given = [sequence.candidates[index].T_world_camera for index in chosen]
        T_up_world = upright([T for T in given if T is not None])
        for done, index in enumerate(chosen):
            yield Progress("images", 0.3 + 0.7 * done / len(chosen))
            candidate = sequence.candidates[index]
            node = _node_of(candidate, sequence, T_up_world)
            write_node(folder_of_rig / f"node_{done:02d}", node)
            written.append(ImportedFrame.of(node, done, candidate.time_s))
    notes = [*sequence.notes, *middle.notes, *_same_view_notes(sequence, node)]
    if sequence.without_poses:
        notes.append(sequence.without_poses)
    if T_up_world is not None:
        notes.append("The world was turned so that z is up")
    if len(chosen) < min(frames, len(sequence.candidates)):
        notes.append(f"No more than {len(chosen)} of the frames overlap by half")
    notes.append(_scale_note(written, middle.units_per_metre))
    return ImportReport(
        kind.name,
        str(folder),
        len(sequence.candidates),
        middle.units_per_metre,
        tuple(written),
        tuple(notes),
    )


def _checked(recording: FolderRecording, check: Check) -> Sequence:
    """Return a recording's frames with the poses that a check returns, and its notes."""
    sequence = recording.sequence
    if recording.T_world_camera is None or first_depth(sequence) is None:
        return sequence
    poses, notes = check(recording)
    poses = poses or [None] * len(sequence.candidates)
    candidates = tuple(
        replace(candidate, T_world_camera=T) for candidate, T in zip(sequence.candidates, poses, strict=True)
    )
    return replace(sequence, candidates=candidates, notes=(*sequence.notes, *notes))


def _from_bag(
    path: Path, out: Path, frames: int, depth_scale: float | None
) -> Generator[Progress, None, ImportReport]:
    bag = yield from part(iterate_bag(path, frames, depth_scale), "files", 0.0, 0.7, detail=True)
    written = []
    with new_folder(out) as folder_of_rig:
        for done, node in enumerate(bag.nodes):
            yield Progress("images", 0.7 + 0.3 * done / len(bag.nodes))
            write_node(folder_of_rig / f"node_{done:02d}", node.images)
            written.append(ImportedFrame.of(node.images, done, node.time_s))
    scales = sorted({node.units_per_metre for node in bag.nodes})
    notes = (*bag.notes, _scale_note(written, *scales))
    scale = scales[0] if len(scales) == 1 else None
    return ImportReport("bag", str(path), bag.candidates, scale, tuple(written), notes)


def _chosen(sequence: Sequence, frames: int) -> tuple[Sequence, tuple[int, ...], ReadDepth]:
    """Choose frames with depth; returns the sequence, their indices in it, and the depth of its middle frame.

    Frames that were tried and have no depth are removed from the sequence.

    Raises:
        InputError: no frame has depth, or one cannot be read.
    """
    left_out = 0
    while True:
        number = len(sequence.candidates)
        at = number // 2
        try:
            middle = depth_in(sequence.candidates[at], sequence)
            chosen = choose(sequence, frames, float(np.nanmedian(middle.depth.z_m)))
            for at in chosen:
                depth_in(sequence.candidates[at], sequence)
        except NoDepthError:
            if number == 1:
                raise
            left_out += 1
            kept = sequence.candidates[:at] + sequence.candidates[at + 1 :]
            sequence = replace(sequence, candidates=kept)
            continue
        notes = left_out_note(left_out, "frame", "without any depth")
        return replace(sequence, notes=(*sequence.notes, *notes)), chosen, middle


def _same_view_notes(sequence: Sequence, node: NodeImages) -> tuple[str, ...]:
    """Return a note if the depth camera of a node is the colour camera, resized, not the recording's own."""
    if sequence.depth_camera is not None or node.depth_camera is None:
        return ()
    return (same_view_note(node.camera, node.depth_camera),)


def _scale_note(written: list[ImportedFrame], *units_per_metre: float) -> str:
    """Return a sentence on the depth scale, or on those of different cameras."""
    units = " or ".join(f"{units:g}" for units in units_per_metre)
    median_m = float(np.median([frame.median_depth_m for frame in written]))
    noun = "unit" if units == "1" else "units"
    return f"Depth: {units} {noun} in a metre, which makes the median depth {median_m:.3g} m"


def _node_of(candidate: Candidate, sequence: Sequence, T_up_world: FloatArray | None) -> NodeImages:
    T = candidate.T_world_camera
    camera = candidate.camera or sequence.camera
    rgb, depth = read_color_of(candidate.color), depth_in(candidate, sequence).depth
    depth_camera, T_color_depth = sequence.depth_camera, sequence.T_color_depth
    if depth_camera is None and rgb.shape[:2] == (camera.height_px, camera.width_px):
        shape = depth.z_m.shape
        names = str(candidate.depth), str(candidate.color)
        depth_camera = depth_camera_of(camera, shape, *names, SAME_VIEW_REMEDY)
        T_color_depth = None if depth_camera is None else np.eye(4)
    return NodeImages(
        str(candidate.color),
        str(candidate.depth),
        rgb,
        depth,
        camera,
        T if T is None or T_up_world is None else T_up_world @ T,
        depth_camera,
        T_color_depth,
    )
