"""Several cameras from a session's image files (SPEC 1.3): each by itself first, then all together."""

from __future__ import annotations

from collections.abc import Generator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from packetmesh.errors import InputError, PacketMeshError
from packetmesh.progress import Progress, part
from pipeline.calibration.board import Board
from pipeline.calibration.depth_from_images import with_depth
from pipeline.calibration.from_images import CameraReport, iterate_calibration
from pipeline.calibration.rig import RelativePose, RigCalibration, Seen, calibrate_rig
from pipeline.calibration.shots import INFRARED, NodeShots, camera_images
from pipeline.config import Lens
from pipeline.io.calibrations import CalibratedNode
from pipeline.kernels.geometry import LEVEL_POSE
from pipeline.types import CameraIntrinsics, FloatArray

ALONE, DEPTH = 0.7, 0.85
"""Shares of the work before which boards and each camera's own lens are found, and after which depth is."""


@dataclass(frozen=True, slots=True)
class RigReport:
    """Calibrated cameras and the images that they come from."""

    board: Board
    cameras: Mapping[str, CameraReport]
    """By name, node_00 and so on, with the lenses as all cameras together have them; the separate depth
    camera of a node is node_00/infrared."""
    rig: RigCalibration

    def nodes(self, T_world_first: FloatArray = LEVEL_POSE) -> dict[str, CalibratedNode]:
        """What a calibration's folder says of every node.

        Args:
            T_world_first: (4, 4) where the first camera stands; by default where a node without a pose does.
        """
        poses = self.rig.T_first_camera
        made = {}
        for name, report in self.cameras.items():
            if name.endswith(INFRARED):
                continue
            node = CalibratedNode(_intrinsics(report), T_world_first @ poses[name])
            beside = name + INFRARED
            if beside in self.cameras:
                node = replace(
                    node,
                    depth_intrinsics=_intrinsics(self.cameras[beside]),
                    T_color_depth=self.rig.relative(beside, name).T_reference_camera,
                )
            made[name] = node
        return made

    def metrics(self) -> dict[str, Any]:
        """What ``--json`` prints."""
        held_out = self.rig.held_out
        return {
            "board": self.board.title,
            "cameras": {name: report.metrics() for name, report in self.cameras.items()},
            "extrinsics": [self._pose_metrics(pose) for pose in self.rig.pairs()],
            "rms_px": self.rig.rms_px,
            "held_out_rms_px": None if held_out is None else held_out.rms_px,
            "moments": list(self.rig.moments),
        }

    def _pose_metrics(self, pose: RelativePose) -> dict[str, Any]:
        held_out = self.rig.held_out if pose.reference == self.rig.names[0] else None
        return {
            "camera": pose.camera,
            "reference": pose.reference,
            "T_reference_camera": pose.T_reference_camera.tolist(),
            "rotation_deg": pose.rotation_deg,
            "baseline_m": pose.baseline_m,
            "standard_errors": {
                "rotation_deg": pose.rotation_sd_deg,
                "position_m": pose.position_sd_m,
                "baseline_m": pose.baseline_sd_m,
            },
            "held_out_rotation_deg": None if held_out is None else held_out.rotation_deg[pose.camera],
            "held_out_position_m": None if held_out is None else held_out.position_m[pose.camera],
            "moments": pose.moments,
        }


def iterate_rig_calibration(
    nodes: Sequence[NodeShots],
    board: Board,
    lens: Lens = "thesis",
    folds: int = 0,
    without: Sequence[str] = (),
    depth_scale: float | None = None,
) -> Generator[Progress, None, RigReport]:
    """Find the board in every image, estimate each camera, then all lenses and poses together.

    Args:
        nodes: their images, by moment.
        board: what they show.
        lens: which distortions the cameras may have.
        folds: in how many turns moments are held out; 0 holds none out.
        without: images to leave out, as node_01/color_03.png.
        depth_scale: depth units in a metre; without it whole numbers are millimetres.

    Yields:
        Progress, before each image.

    Raises:
        InputError: unreadable images, several sizes in one camera, the board in too few of them, an image to
            leave out that is not there, or cameras that never see the board together.
        ReconstructionError: the views do not determine a lens or the poses.
    """
    images = camera_images(nodes)
    left_out: dict[str, list[str]] = {name: [] for name in images}
    for word in without:
        name, _, image = word.rpartition("/")
        if name not in images:
            raise InputError(f"{word} is none of the cameras' images; name it as {next(iter(images))}/...")
        left_out[name].append(image)
    reports: dict[str, CameraReport] = {}
    for index, (name, files) in enumerate(images.items()):
        steps = iterate_calibration(list(files), board, lens, 0, left_out[name])
        begin, end = (ALONE * share / len(images) for share in (index, index + 1))
        try:
            reports[name] = yield from part(steps, name, begin, end, detail=True)
        except PacketMeshError as error:
            raise type(error)(f"{name}: {error}") from None
    yield Progress("placing the cameras", ALONE)
    together = cameras_together(nodes, reports, board, folds)
    yield Progress("comparing depth with the board", DEPTH)
    measured = {node.name: node_with_depth(node, together.cameras, depth_scale) for node in nodes}
    return replace(together, cameras={**together.cameras, **measured})


def cameras_together(
    nodes: Sequence[NodeShots], reports: Mapping[str, CameraReport], board: Board, folds: int = 0
) -> RigReport:
    """All lenses and poses together, from cameras that are calibrated each by itself.

    Args:
        nodes: their images, by moment.
        reports: by camera; one without a report has no part.
        board: what the images show.
        folds: in how many turns moments are held out; 0 holds none out.

    Raises:
        InputError: fewer than two cameras, or some that never see the board together.
        ReconstructionError: the views do not determine the poses.
    """
    images = camera_images(nodes)
    seen = {name: _seen(report, images[name]) for name, report in reports.items()}
    rig = calibrate_rig({name: one.calibration for name, one in reports.items()}, seen, board, folds)
    together = {
        name: replace(
            one,
            calibration=rig.cameras[name],
            held_out=() if rig.held_out is None else rig.held_out.views[name],
        )
        for name, one in reports.items()
    }
    return RigReport(board, together, rig)


def node_with_depth(
    node: NodeShots, reports: Mapping[str, CameraReport], depth_scale: float | None = None
) -> CameraReport:
    """A node's own report with the bias of its depth sensor, or why that is not known.

    Args:
        node: its images.
        reports: by camera, the node's and, if its depth has a camera of its own, that one's.
        depth_scale: depth units in a metre; without it whole numbers are millimetres.
    """
    report, own = reports[node.name], reports.get(node.name + INFRARED)
    if own is None and any(shot.infrared is not None for shot in node.shots):
        reason = f"{node.name}{INFRARED} has no lens, and its depth is judged through it"
        return replace(report, depth_reason=reason)
    grids = ((shot.color if own is None else shot.infrared, shot.depth) for shot in node.shots)
    depths = {image.name: depth for image, depth in grids if image is not None and depth is not None}
    return with_depth(report, depths, own, depth_scale)


def _seen(report: CameraReport, files: Mapping[Path, str]) -> dict[str, Seen]:
    """By moment."""
    moments = {path.name: moment for path, moment in files.items()}
    return {moments[view.name]: Seen(view, report.detections[view.name].oriented) for view in report.views}


def _intrinsics(report: CameraReport) -> CameraIntrinsics | None:
    """None of a lens that the chain does not know."""
    try:
        return report.intrinsics
    except InputError:
        return None
