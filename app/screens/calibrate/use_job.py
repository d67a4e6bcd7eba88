"""Writes the calibration that is shown as a folder that the chain lays over the rig."""

from __future__ import annotations

from collections.abc import Generator
from pathlib import Path

from app.screens.calibrate.bias import bias_of
from app.screens.calibrate.files import camera_files
from app.screens.calibrate.job import camera_of
from app.screens.calibrate.view import CameraView
from app.state import Spec
from app.store import Store
from packetmesh.errors import InputError
from packetmesh.progress import Progress
from pipeline.io.calibrations import CalibratedNode, write_calibration
from pipeline.io.depth_correction import FILE_NAME, write_depth_correction
from pipeline.types import CameraIntrinsics

CHAIN_LENSES = ("thesis", "brown")
"""Those that the chain can undo."""


def use_job(store: Store, spec: Spec, folder: str) -> Generator[Progress, None, str]:
    """Write the cameras, and the correction of their depth where it is known.

    Returns:
        The folder.

    Raises:
        InputError: no camera has a lens, a lens is one that the chain does not know, or the cameras are not
            those of the rig.
    """
    views = spec.views
    assert views is not None
    rig = yield from store.stage(spec, "rig")
    sizes_px = {frame.name: (frame.intrinsics.width_px, frame.intrinsics.height_px) for frame in rig.frames}
    nodes, corrections = {}, {}
    names = list(camera_files(Path(views.folder)))
    for index, name in enumerate(names):
        camera = yield from camera_of(store, views, name, index / len(names), 1.0 / len(names))
        if camera.calibration is None:
            continue
        _check(camera, sizes_px)
        lens = camera.calibration
        intrinsics = CameraIntrinsics(lens.matrix, lens.distortion[:5].copy(), *lens.size_px)
        nodes[name] = CalibratedNode(intrinsics)
        found = yield from bias_of(store, views, camera, index / len(names))
        if not isinstance(found, str):
            corrections[name] = found.correction
    if not nodes:
        raise InputError("No camera is calibrated yet; add views of the board first")
    write_calibration(folder, nodes)
    for name, correction in corrections.items():
        write_depth_correction(Path(folder) / name / FILE_NAME, correction)
    return folder


def _check(camera: CameraView, sizes_px: dict[str, tuple[int, int]]) -> None:
    lens = camera.calibration
    assert lens is not None
    if camera.name not in sizes_px:
        raise InputError(
            f"The scene has no {camera.name}, only {', '.join(sizes_px)}; choose under 'Taken by' whose photographs "
            "these are"
        )
    if sizes_px[camera.name] != lens.size_px:
        (width, height), (own_width, own_height) = sizes_px[camera.name], lens.size_px
        raise InputError(
            f"{camera.name} of the scene has {width} x {height} pixels and the photographs {own_width} x "
            f"{own_height}; a calibration is good for one size only"
        )
    if lens.lens not in CHAIN_LENSES:
        raise InputError(
            f"The chain knows no {lens.lens} lens; choose {' or '.join(CHAIN_LENSES)} under Advanced to use it"
        )
