"""Files and metrics of a recording's trajectory."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from packetmesh.files import write_json
from pipeline.io.poses import write_tum
from pipeline.types import FloatArray, Walk

LEAST_DISTURBED = 3
"""Fewest frames in which something moved that are worth a sentence."""
LEAST_AGREEING = 0.92
"""Smallest agreement of cameras at their right poses in the demo rooms (SPEC 4.10)."""
FILES = ("trajectory.txt", "trajectory.json")


def write_trajectory(folder: Path, walk: Walk) -> list[Path]:
    """Write the colour camera's poses in TUM's form, and the keyframes with their registrations as JSON.

    Frames without a pose have no line.

    Raises:
        InputError: the folder cannot be written.
    """
    files = [folder / name for name in FILES]
    write_tum(files[0], walk.times_s, walk.T_world_camera)
    links = [
        {
            "source": link.source,
            "target": link.target,
            "loop": link.loop,
            "used": link.used,
            "overlap_share": link.overlap_share,
            "agreeing_share": link.agreeing_share,
            "T_target_source": link.T_target_source,
            "information": link.information,
        }
        for link in walk.links
    ]
    write_json(files[1], {"keyframes": walk.keyframes, "links": links})
    return files


def walk_metrics(walk: Walk, elapsed_s: float) -> dict[str, Any]:
    """Return the numbers of a recording: counts, lengths in metres, frames per second.

    Args:
        walk: the recording.
        elapsed_s: time from opening the recording to the finished map, without interrupted runs.
    """
    frames = len(walk.times_s)
    return {
        "frames": frames,
        "keyframes": len(walk.keyframes),
        "loops": _loops(walk),
        **_losses(walk),
        "path_m": path_m(walk.T_world_camera),
        "voxel_m": walk.voxel_m,
        "map_points": len(walk.map),
        "frames_per_s": frames / (walk.resumed_s + elapsed_s),
    }


def walk_sentences(walk: Walk, shown: int) -> list[str]:
    """Return a summary and a sentence on lost frames; ``shown`` keyframes are the nodes of the rig."""
    summary = (
        f"A recording of {len(walk.times_s)} frames over {path_m(walk.T_world_camera):.1f} m; its nodes are "
        f"{shown} of its {len(walk.keyframes)} keyframe{'s' * (len(walk.keyframes) != 1)}"
    )
    return [summary, *lost_sentences(_losses(walk) | {"frames": len(walk.times_s)})]


def _losses(walk: Walk) -> dict[str, Any]:
    """Return the spans of frames without poses, in all and by cause, and the number of disturbed frames.

    ``without_depth`` and ``apart`` are as in ``Walk``.
    """
    return {
        "lost": lost_spans(walk.T_world_camera),
        "without_depth": _spans(walk.without_depth),
        "apart": _spans(walk.apart),
        "disturbed": len(walk.disturbed),
    }


def lost_sentences(recording: Mapping[str, Any], agreeing_share: float = 1.0) -> list[str]:
    """Return sentences on frames without a pose, by cause, and on what moved.

    Args:
        recording: numbers of ``walk_metrics``.
        agreeing_share: share of what two keyframes measured that agrees; NaN if no two measured the same.
    """
    frames = recording["frames"]
    blind, apart = (_numbers(recording[name]) for name in ("without_depth", "apart"))
    other = _spans(sorted(_numbers(recording["lost"]) - blind - apart))
    found = []
    if blind:
        found.append(
            f"{_of(_spans(sorted(blind)), frames)} no depth, or too little to be tracked, and are not in the "
            "surface; keep the camera uncovered, and within its range of what it sees"
        )
    if apart:
        found.append(
            f"{_of(_spans(sorted(apart)), frames)} no connection with the mapped part of the recording, "
            "because too little was recognised in them, and are not in the surface; record a way between, "
            "with little that moves in view"
        )
    if other:
        where = _where(other)
        found.append(
            f"The camera was lost in {_count(other)} of {frames} frames ({where}), which are not in the "
            "surface; turn more slowly, keep in view what was seen before, and let little of the view move"
        )
    moved = (
        "something moved, such as a person, and the surface may be wrong; try to record when nothing moves"
    )
    if recording["disturbed"] >= LEAST_DISTURBED:
        found.append(
            f"In {recording['disturbed']} of {frames} frames a tenth or more of the view does not agree with "
            f"the frames before: {moved}"
        )
    elif agreeing_share < LEAST_AGREEING:
        found.append(
            f"Of what two keyframes measured only {agreeing_share:.1%} agrees (in the demo rooms "
            f"{LEAST_AGREEING:.0%} or more): probably {moved}"
        )
    return found


def _of(spans: list[tuple[int, int]], frames: int) -> str:
    """Return how many frames are in spans, and which, with a verb."""
    count = _count(spans)
    return f"{count} of {frames} frames ({_where(spans)}) {'has' if count == 1 else 'have'}"


def _where(spans: list[tuple[int, int]]) -> str:
    """Return the first few spans as text."""
    where = ", ".join(f"{first} to {last}" if last > first else f"{first}" for first, last in spans[:4])
    return where if len(spans) <= 4 else f"{where} and {len(spans) - 4} more times"


def _count(spans: list[tuple[int, int]]) -> int:
    return sum(last - first + 1 for first, last in spans)


def _numbers(spans: list[tuple[int, int]]) -> set[int]:
    return {k for first, last in spans for k in range(first, last + 1)}


def _loops(walk: Walk) -> int:
    return sum(link.loop and link.used for link in walk.links)


def lost_spans(T_world_camera: tuple[FloatArray | None, ...]) -> list[tuple[int, int]]:
    """Return first and last frame number of each gap without poses."""
    return _spans([k for k, T in enumerate(T_world_camera) if T is None])


def _spans(numbers: Sequence[int]) -> list[tuple[int, int]]:
    """Return first and last of each run of consecutive numbers, which ascend."""
    spans: list[tuple[int, int]] = []
    for k in numbers:
        first = spans.pop()[0] if spans and spans[-1][1] == k - 1 else k
        spans.append((first, k))
    return spans


def path_m(T_world_camera: tuple[FloatArray | None, ...]) -> float:
    """Return the path length, metres: from frame to frame, straight across gaps."""
    at_m = np.array([T[:3, 3] for T in T_world_camera if T is not None]).reshape(-1, 3)
    return float(np.linalg.norm(np.diff(at_m, axis=0), axis=1).sum())
