"""Poses of a rig's cameras from their base layers alone, before any tile is sent."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np

from packetmesh.progress import drain
from pipeline.config import PipelineConfig
from pipeline.delivery import coarse
from pipeline.delivery.base_points import BaseView
from pipeline.kernels.geometry import scaled_to
from pipeline.placement.outcome import Placement
from pipeline.sources import LoadedRig
from pipeline.spec import Spec
from pipeline.stages import RunCache, compute
from pipeline.types import ByteArray, CameraIntrinsics, DepthMap, RgbdFrame, Rig


def place_by_base(
    views: Sequence[BaseView],
    colors: Sequence[ByteArray],
    config: PipelineConfig | None = None,
    pose_known: Sequence[bool] | None = None,
) -> Placement:
    """Register a rig's cameras by their base layers, as images of one pixel a block.

    In eight rooms, 80 x 60 blocks and starts off by 6 cm and 3 degrees, the cameras ended .2 to 1.7 cm and .1
    to .8 degrees from their true poses.

    Args:
        views: base layers with the believed poses.
        colors: (H, W, 3) RGB of each, as decoded from the base layer.
        config: settings of the chain; None takes the defaults.
        pose_known: whether each believed pose is known; None means that all are.

    Raises:
        PacketMeshError: the registration cannot work with the base layers; the message says why.
    """
    frames = tuple(
        RgbdFrame(
            f"camera {index}",
            cv2.resize(rgb, view.z_m.shape[::-1], interpolation=cv2.INTER_AREA),
            DepthMap(view.z_m.astype(np.float32)),
            _camera(view),
            view.T_world_camera,
            noise=view.noise,
            pose_known=known,
        )
        for index, (view, rgb, known) in enumerate(
            zip(views, colors, pose_known or [True] * len(views), strict=True)
        )
    )
    spec = Spec(LoadedRig(Rig("base layers", frames)), config=config or PipelineConfig())
    placement: Placement = drain(compute(spec, "placement", RunCache())).value
    return placement


def _camera(view: BaseView) -> CameraIntrinsics:
    """Return the camera of an image of one pixel a block."""
    rows, columns = view.z_m.shape
    whole = CameraIntrinsics(
        view.intrinsics.matrix,
        view.intrinsics.distortion,
        columns * coarse.DEPTH_BLOCK,
        rows * coarse.DEPTH_BLOCK,
        view.intrinsics.fisheye,
    )
    camera = scaled_to(whole, columns, rows)
    assert camera is not None  # the size is a whole multiple
    return camera
