"""Files and metrics of a recording's trajectory."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from packetmesh.files import write_json
from pipeline.io.poses import write_tum
from pipeline.types import FloatArray, Walk

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
        "lost": lost_spans(walk.T_world_camera),
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
    return [summary, *lost_sentences(lost_spans(walk.T_world_camera), len(walk.times_s))]


def lost_sentences(spans: list[tuple[int, int]], frames: int) -> list[str]:
    """Return a sentence on the frames without a pose, from ``lost_spans``; nothing if all have one."""
    if not spans:
        return []
    count = sum(last - first + 1 for first, last in spans)
    where = ", ".join(f"{first} to {last}" if last > first else f"{first}" for first, last in spans[:4])
    more = "" if len(spans) <= 4 else f" and {len(spans) - 4} more times"
    return [
        f"The camera was lost in {count} of {frames} frames ({where}{more}), which are not in the surface; "
        "turn more slowly, and keep in view what was seen before"
    ]


def _loops(walk: Walk) -> int:
    return sum(link.loop and link.used for link in walk.links)


def lost_spans(T_world_camera: tuple[FloatArray | None, ...]) -> list[tuple[int, int]]:
    """Return first and last frame number of each gap without poses."""
    spans: list[tuple[int, int]] = []
    for k, T in enumerate(T_world_camera):
        if T is None:
            first = spans.pop()[0] if spans and spans[-1][1] == k - 1 else k
            spans.append((first, k))
    return spans


def path_m(T_world_camera: tuple[FloatArray | None, ...]) -> float:
    """Return the path length, metres: from frame to frame, straight across gaps."""
    at_m = np.array([T[:3, 3] for T in T_world_camera if T is not None]).reshape(-1, 3)
    return float(np.linalg.norm(np.diff(at_m, axis=0), axis=1).sum())
