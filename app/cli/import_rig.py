"""``packetmesh import``: recordings in other formats as rigs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import tyro

from app.cli.text import print_json, say, say_progress
from packetmesh.progress import drain


def import_rig(
    path: Annotated[Path, tyro.conf.Positional],
    out: Path,
    frames: int = 3,
    depth_scale: float | None = None,
    intrinsics: Path | None = None,
    json: bool = False,
) -> None:
    """Make a rig of frames of a recording: TUM, 7-Scenes, ScanNet, SUN RGB-D, Redwood, Open3D, COLMAP, ROS.

    Args:
        path: The recording's folder, unpacked; or a bag of ROS 1 or 2 (.bag, .db3, .mcap or its folder).
        out: The rig's folder, new or empty; `packetmesh reconstruct --rig` takes it.
        frames: How many frames become nodes, at most 6; chosen apart from each other but overlapping. A
            bag of several cameras gives a node a camera.
        depth_scale: Depth units per metre; without it what the kind of recording uses.
        intrinsics: The colour camera, if there is no file of it beside the images or another is meant.
        json: Print what was found and taken as one JSON object.
    """
    from dataclasses import asdict

    from pipeline.importing import iterate_import

    report = drain(iterate_import(path, out, frames, depth_scale, intrinsics), say_progress)
    say(f"100%  {report.kind}: {len(report.frames)} nodes of {report.candidates} moments in {report.folder}")
    for frame in report.frames:
        say(f"{frame.node}  {frame.color}, {frame.depth}")
    for note in report.notes:
        say(note)
    say(f"Next: packetmesh reconstruct --rig {out} --out runs/{out.name}")
    if json:
        print_json(asdict(report))
