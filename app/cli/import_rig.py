"""``packetmesh import``: recordings in other formats as rigs, or as folders in TUM's form."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import tyro

from app.cli.text import print_json, say, say_progress
from packetmesh.progress import drain


def import_rig(
    path: Annotated[Path, tyro.conf.Positional],
    out: Path,
    frames: int | Literal["all"] = 3,
    depth_scale: float | None = None,
    intrinsics: Path | None = None,
    json: bool = False,
) -> None:
    """Convert a recording from a data set, COLMAP, nerfstudio, ROS or a telephone to a rig.

    Data sets: TUM, ICL-NUIM, 7-Scenes, ScanNet, SUN RGB-D, Redwood and Open3D. Telephones: Stray Scanner,
    Polycam, Record3D and 3D Scanner App. Depth cameras: Azure Kinect and Femto.

    Args:
        path: The recording's folder, unpacked; or a bag of ROS 1 or 2 (.bag, .db3, .mcap or its folder), or
            a .r3d of Record3D, .sens of ScanNet or .mkv of Azure Kinect.
        out: Folder for the rig, new or empty; give it to `packetmesh reconstruct --rig`.
        frames: Number of frames that become nodes, at most 200; they are far apart but overlap. A bag of
            several cameras gives one node for each camera. With `all`, the folder gets every frame of one
            camera in TUM's form instead, for `packetmesh reconstruct --recording` and other programs.
        depth_scale: Depth units per metre; without it, the value of the kind of recording.
        intrinsics: File with the intrinsics of the colour camera, if the recording has none or another one is
            meant.
        json: Print the frames that were found and used as one JSON object.
    """
    from dataclasses import asdict

    from pipeline.recording.imported import iterate_checked_import, iterate_checked_keep

    if frames == "all":
        kept = drain(iterate_checked_keep(path, out, depth_scale, intrinsics), say_progress)
        say(f"100%  {kept.kind}: {kept.frames} of {kept.candidates} frames in {kept.folder}")
        for note in kept.notes:
            say(note)
        say(f"Next: packetmesh reconstruct --recording {out} --out runs/{out.name}")
        if json:
            print_json(asdict(kept))
        return
    report = drain(iterate_checked_import(path, out, frames, depth_scale, intrinsics), say_progress)
    nodes = f"{len(report.frames)} node{'s' * (len(report.frames) != 1)}"
    say(f"100%  {report.kind}: {nodes} of {report.candidates} moments in {report.folder}")
    for frame in report.frames:
        say(f"{frame.node}  {frame.color}, {frame.depth}")
    for note in report.notes:
        say(note)
    say(f"Next: packetmesh reconstruct --rig {out} --out runs/{out.name}")
    if json:
        print_json(asdict(report))
