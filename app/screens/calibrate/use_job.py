"""The job that writes the shown calibration as a folder that the chain applies to the rig."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import replace
from pathlib import Path

from app.compute.state import Spec
from app.compute.store import Store
from app.screens.calibrate.cameras import CamerasFound, bias_of, cameras_of, finished
from app.screens.calibrate.request import inner
from packetmesh.errors import InputError
from packetmesh.progress import Progress
from pipeline.calibration.shots import INFRARED
from pipeline.io.calibrations import CalibratedNode, write_calibration
from pipeline.io.depth_correction import DEPTH_CORRECTION, write_depth_correction
from pipeline.kernels.geometry import LEVEL_POSE
from pipeline.types import CameraIntrinsics, Rig


def use_job(store: Store, spec: Spec, folder: str) -> Generator[Progress, None, str]:
    """Write the cameras, their poses if all were placed together, and the known corrections of their depth.
    The first camera keeps its pose in the rig.

    Returns:
        The folder.

    Raises:
        InputError: no camera has a lens, or the cameras are not those of the rig.
    """
    views, source = spec.views, spec.source
    assert views is not None
    rig: Rig = yield from store.stage(replace(spec, source=inner(source)), "rig")
    known = yield from finished(cameras_of(store, views))
    if not known.reports:
        raise InputError("No camera is calibrated yet; add views of the board first")
    for name, report in known.reports.items():
        if not name.endswith(INFRARED):
            _check(name, report.intrinsics, rig)
    nodes = _nodes(known, rig)
    write_calibration(folder, nodes)
    for index, name in enumerate(nodes):
        found = yield from bias_of(store, views, known, name, index / len(nodes))
        if not isinstance(found, str):
            write_depth_correction(Path(folder) / name / DEPTH_CORRECTION, found.correction)
    return folder


def _nodes(known: CamerasFound, rig: Rig) -> dict[str, CalibratedNode]:
    """Return the nodes by name. They have poses only if every camera of the rig was placed: a camera without
    one would keep its pose in another world frame.
    """
    if known.rig is None:
        return {
            name: CalibratedNode(report.intrinsics, focal_sd=report.calibration.focal_sd)
            for name, report in known.reports.items()
            if not name.endswith(INFRARED)
        }
    believed = {frame.name: frame.T_world_camera for frame in rig.frames}
    nodes = known.rig.nodes(believed.get(known.rig.rig.names[0], LEVEL_POSE))
    if set(nodes) == set(believed):
        return nodes
    return {name: replace(node, T_world_camera=None) for name, node in nodes.items()}


def _check(name: str, camera: CameraIntrinsics, rig: Rig) -> None:
    """Raise InputError if the scene has no camera of this name and image size."""
    sizes_px = {frame.name: (frame.intrinsics.width_px, frame.intrinsics.height_px) for frame in rig.frames}
    if name not in sizes_px:
        raise InputError(
            f"The scene has no {name}, only {', '.join(sizes_px)}; choose under 'Taken by' the camera "
            "that took these photographs"
        )
    if sizes_px[name] != (camera.width_px, camera.height_px):
        width, height = sizes_px[name]
        raise InputError(
            f"{name} of the scene has {width} x {height} pixels and the photographs {camera.width_px} x "
            f"{camera.height_px}; calibrate from photographs of the scene's size"
        )
