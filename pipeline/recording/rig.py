"""A rig whose nodes hold recordings of cameras that stand: each is averaged (SPEC 10.4)."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import replace
from pathlib import Path

from packetmesh.errors import InputError
from packetmesh.progress import Progress, part
from pipeline.importing import is_recording
from pipeline.importing.recorded import iterate_opening
from pipeline.io.calibrations import FILES, NodeFiles, node_files
from pipeline.io.poses import read_pose_noted
from pipeline.io.rigs import is_pair, is_rig, load_node, nodes_in
from pipeline.io.truth import read_truth
from pipeline.recording.opening import iterate_still, stands
from pipeline.recording.walk import LEAST_FRAMES
from pipeline.types import AnyPath, RgbdFrame, Rig


def holds_recordings(directory: AnyPath) -> bool:
    """Return whether a node of a rig is a recording instead of a pair of images."""
    folder = Path(directory)
    return folder.is_dir() and is_rig(folder) and any(_is_recorded(node) for node in nodes_in(folder))


def _is_recorded(node: Path) -> bool:
    """Return whether a node's folder is a recording, or contains one."""
    return not is_pair(node) and any(is_recording(place) for place in (node, *node.iterdir()))


def iterate_recorded_rig(
    directory: AnyPath, frames: int, depth_scale: float | None = None
) -> Generator[Progress, None, Rig]:
    """Load a rig of which some nodes are recordings, of cameras that stand.

    Args:
        directory: contains node_00, node_01 and so on, each a recording that ``open_recording`` reads, or
            the images of a node as in ``load_rig``. A recording's pose is that in its node_NN/pose.txt, else
            its own if it has one.
        frames: number of frames of each recording that are averaged.
        depth_scale: depth units per metre of every node.

    Raises:
        InputError: the rig or a node cannot be used, or the camera of a node walks.
    """
    folder = Path(directory)
    nodes = nodes_in(folder)
    found: list[RgbdFrame] = []
    for index, node in enumerate(nodes):
        begin, end = index / len(nodes), (index + 1) / len(nodes)
        if _is_recorded(node):
            steps = _iterate_node(node, frames, depth_scale)
            found.append((yield from part(steps, node.name, begin, end, detail=True)))
        else:
            yield Progress(f"loading {node.name}", begin)
            found.append(load_node(node, NodeFiles(), depth_scale))
    return Rig(folder.resolve().name, tuple(found), read_truth(folder, [frame.name for frame in found]))


def _iterate_node(node: Path, frames: int, depth_scale: float | None) -> Generator[Progress, None, RgbdFrame]:
    """Average the recording of a node, and read its pose."""
    files = node_files(node)
    unused = sorted(files.keys() - {"intrinsics", "pose"})
    if unused:
        raise InputError(f"{node} has {FILES[unused[0]]}, which recordings do not use; try to move it away")
    intrinsics = None if is_recording(node) else files.get("intrinsics")
    steps = iterate_opening(node, depth_scale, intrinsics)
    recording = yield from part(steps, "opening", 0.0, 0.2, detail=True)
    if len(recording.times_s) >= LEAST_FRAMES and not stands(recording, frames):
        raise InputError(
            f"The camera of {node} does not stand still, as a rig's cameras must; for it alone, try "
            f"`packetmesh reconstruct --recording {node}`"
        )
    average = iterate_still(recording, frames)
    frame = yield from part(average, "averaging", 0.2, 1.0, detail=True)
    frame = replace(frame, name=node.name)
    if "pose" not in files:
        return frame
    T, notes = read_pose_noted(files["pose"])
    return replace(frame, T_world_camera=T, pose_known=True, notes=(*frame.notes, *notes))
