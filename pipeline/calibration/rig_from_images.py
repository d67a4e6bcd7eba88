"""Calibration of several cameras from a session's image files (SPEC 1.3): first each alone, then together."""

from __future__ import annotations

from collections.abc import Generator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from packetmesh.errors import InputError, PacketMeshError, ReconstructionError
from packetmesh.progress import Progress, part
from pipeline.calibration.board import Board
from pipeline.calibration.depth_from_images import with_depth
from pipeline.calibration.estimate import check_possible
from pipeline.calibration.from_images import CameraReport, iterate_calibration
from pipeline.calibration.rig import RelativePose, RigCalibration, Seen, calibrate_rig
from pipeline.calibration.shots import INFRARED, NodeShots, camera_images
from pipeline.config import Lens
from pipeline.io.calibrations import CalibratedNode
from pipeline.kernels.geometry import LEVEL_POSE
from pipeline.types import FloatArray

ALONE, DEPTH = 0.7, 0.85
"""Progress when all cameras are calibrated alone, and when the calibration of depth starts."""


@dataclass(frozen=True, slots=True)
class RigReport:
    """Calibrated cameras and their images."""

    board: Board
    cameras: Mapping[str, CameraReport]
    """Reports by name, node_00 and so on, with lenses estimated from all cameras together; a node's separate
    depth camera is node_00/infrared."""
    rig: RigCalibration

    def nodes(self, T_world_first: FloatArray = LEVEL_POSE) -> dict[str, CalibratedNode]:
        """Return the calibration of every node, for its folder; separate depth cameras belong to their nodes.

        Args:
            T_world_first: (4, 4) pose of the first camera; by default ``LEVEL_POSE``.
        """
        poses = self.rig.T_first_camera
        made = {}
        for name, report in self.cameras.items():
            if name.endswith(INFRARED):
                continue
            sd = report.calibration.focal_sd
            node = CalibratedNode(report.intrinsics, T_world_first @ poses[name], focal_sd=sd)
            beside = name + INFRARED
            if beside in self.cameras:
                node = replace(
                    node,
                    depth_intrinsics=self.cameras[beside].intrinsics,
                    T_color_depth=self.rig.relative(beside, name).T_reference_camera,
                )
            made[name] = node
        return made

    def metrics(self) -> dict[str, Any]:
        """Return the values that ``--json`` prints."""
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
        nodes: images of the nodes, by moment.
        board: the board in them.
        lens: distortion model of the cameras.
        folds: number of folds of held-out moments; 0 holds none out.
        without: images to leave out, with their camera, such as node_01/color_03.png.
        depth_scale: depth units per metre; by default whole numbers are millimetres.

    Yields:
        Progress before each image and each later step.

    Raises:
        InputError: images are unreadable, differ in size within a camera, too few show the board, an image to
            leave out does not exist, or cameras never see the board together.
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
    """Estimate all lenses and poses together, from cameras that were calibrated alone.

    Args:
        nodes: images of the nodes, by moment.
        reports: reports by camera; cameras without a report are ignored.
        board: the board in the images.
        folds: number of folds of held-out moments; 0 holds none out.

    Raises:
        InputError: there are fewer than two cameras, or some never see the board together.
        ReconstructionError: the views do not determine the poses, or the best camera is impossible.
    """
    images = camera_images(nodes)
    seen = {name: _seen(report, images[name]) for name, report in reports.items()}
    rig = calibrate_rig({name: one.calibration for name, one in reports.items()}, seen, board, folds)
    for name, found in rig.cameras.items():
        try:
            check_possible(found)
        except ReconstructionError as error:
            raise ReconstructionError(f"{name}: {error}") from None
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
    """Return a node's report with the bias of its depth sensor, or the reason why it is unknown.

    Args:
        node: images of the node.
        reports: reports by camera: the node's, and that of its separate depth camera if it has one.
        depth_scale: depth units per metre; by default whole numbers are millimetres.
    """
    report, own = reports[node.name], reports.get(node.name + INFRARED)
    if own is None and any(shot.infrared is not None for shot in node.shots):
        reason = f"{node.name}{INFRARED} has no lens, and its depth is judged through it"
        return replace(report, depth_reason=reason)
    grids = ((shot.color if own is None else shot.infrared, shot.depth) for shot in node.shots)
    depths = {image.name: depth for image, depth in grids if image is not None and depth is not None}
    return with_depth(report, depths, own, depth_scale)


def _seen(report: CameraReport, files: Mapping[Path, str]) -> dict[str, Seen]:
    """Return the board's views in a camera, by moment."""
    moments = {path.name: moment for path, moment in files.items()}
    return {moments[view.name]: Seen(view, report.detections[view.name].oriented) for view in report.views}
