"""Completion of a sensor's depth by a network, from colours and depth with holes (SPEC 3.6)."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from packetmesh.errors import InputError
from pipeline.depth.extension import extrapolated
from pipeline.depth.sessions import modified_ns, open_session
from pipeline.depth.slopes import cell_px, coarse, network_input, solved
from pipeline.types import BoolArray, ByteArray, DepthMap, FloatArray

SHIPPED_COMPLETION = Path(__file__).resolve().parents[2] / "assets" / "depth" / "completion.onnx"
LARGEST_MISMATCH = 0.1
"""A measured pixel that differs more from the grid, in logarithmic depth, is on another surface."""


@dataclass(frozen=True, slots=True)
class CompletedDepth:
    """Output of the completion network for one frame."""

    depth: DepthMap
    """(H, W) metres; measured depth is unchanged. NaN where a user's own network gives no depth."""
    log_scale: FloatArray
    """(H, W) float32, logarithm of the estimated mean absolute error of logarithmic depth."""
    fine: bool = False
    """Whether the depth has the image's resolution; it then replaces aligned depth up to the holes' rims."""


def complete(sensor: DepthMap, rgb: ByteArray, model: Path = SHIPPED_COMPLETION) -> CompletedDepth:
    """Extend measured depth into its holes.

    The network predicts depth differences between near and far pixels, and the certainty of each; the depth
    that fits these best is adapted to the measured depth (``pipeline.depth.slopes``).

    Args:
        sensor: (H, W) metric depth with holes; at least one pixel is measured.
        rgb: (H, W, 3) uint8 colours on the same grid.
        model: ONNX file of the completion network.

    Raises:
        InputError: the images differ in size, no pixel is measured, or the file is missing or not readable.
    """
    require_same_grid(sensor, rgb)
    grid = coarse(sensor.z_m, sensor.valid, rgb)
    planes, start = network_input(grid)
    session = open_session(model, modified_ns(model))
    (output,) = session.run(None, {session.get_inputs()[0].name: planes[None]})
    log_z = solved(grid, start, output[0])
    log_scale = output[0, 1, : start.shape[0], : start.shape[1]]
    shape = sensor.z_m.shape
    met_m = meeting(enlarged(log_z, shape), sensor, rgb)
    return CompletedDepth(
        DepthMap(np.where(sensor.valid, sensor.z_m, met_m).astype(np.float32)),
        enlarged(log_scale, shape),
    )


def require_same_grid(sensor: DepthMap, rgb: ByteArray) -> None:
    """Raise an InputError if depth and colours differ in size, or nothing is measured."""
    if rgb.shape != (*sensor.z_m.shape, 3):
        raise InputError(
            f"Sensor depth {sensor.z_m.shape} and colours {rgb.shape} are not on one pixel grid: "
            "register the images first."
        )
    if not sensor.valid.any():
        raise InputError("The sensor depth has no valid pixel to complete; use another frame.")


def enlarged(plane: FloatArray, shape: tuple[int, int]) -> FloatArray:
    """Enlarge a plane of the grid to (H, W) so that the cells' centres keep their places."""
    rows, columns = shape
    step = cell_px(columns)
    height, width = plane.shape
    whole = cv2.resize(plane, (width * step, height * step), interpolation=cv2.INTER_LINEAR)
    return np.asarray(whole[:rows, :columns], np.float32)


def meeting(log_z: FloatArray, sensor: DepthMap, rgb: ByteArray) -> FloatArray:
    """Correct completed log depth (H, W) to meet the measured depth around every hole; returns metres."""
    measured_log = np.log(np.where(sensor.valid, sensor.z_m, 1.0)).astype(np.float32)
    mismatch = np.where(sensor.valid, measured_log - log_z, np.float32(0.0))
    usable: BoolArray = sensor.valid & (np.abs(mismatch) < LARGEST_MISMATCH)
    if usable.any():
        log_z = log_z + extrapolated(np.where(usable, mismatch, np.float32(0.0)), usable, rgb)
    return np.exp(log_z)
