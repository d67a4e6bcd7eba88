"""Completion of measured depth by a user's own network, which takes image and depth.

The format of the input image is read as for other depth networks (``pipeline.depth.conventions``); by default
its values go from 0 to 1, as for LingBot-Depth. Depth goes in and comes out in metres, or in the unit of the
file's metadata:

    depth_unit_m  0.001: depth is in millimetres; 10: a depth of 1 means 10 m

Unknown depth is 0, in and out.
"""

from __future__ import annotations

import threading
from collections.abc import Mapping
from math import inf
from pathlib import Path

import cv2
import numpy as np

from packetmesh.errors import InputError, ReconstructionError
from pipeline.config import DepthConfig, Normalisation
from pipeline.depth.completion import CompletedDepth, complete, meeting, require_same_grid
from pipeline.depth.completion_signature import completion_signature_of
from pipeline.depth.conventions import Overrides, flagged, from_metadata, in_graph
from pipeline.depth.inference import depth_of, network_image, network_input, run_network
from pipeline.depth.preprocessing import unpad
from pipeline.depth.sessions import modified_ns, open_session
from pipeline.depth.signature import layout_of
from pipeline.depth.slopes import LOG_SCALES
from pipeline.types import BoolArray, ByteArray, DepthMap, FloatArray

SHORTEST_PX, MULTIPLE_PX = 480, 32
"""Shorter side of the input of a network that takes any size, and the divisor of both sides."""
LARGEST_DEVIATION = 0.25
"""Median difference, in logarithmic depth, from the measured depth beyond which the output is no depth."""
PATCHES_ACROSS = 24
"""Squares across the image, of which every fifth is hidden to measure the network's error."""
_one_at_a_time = threading.Lock()
"""Nodes are prepared in parallel, but each run of a network may take all the memory that it is allowed."""


class OwnCompletion:
    """A loaded network that completes depth."""

    def __init__(self, model_path: str | Path, normalisation: Normalisation | None = None) -> None:
        """Load the ONNX file.

        Args:
            model_path: network that maps image and depth to depth.
            normalisation: scaling of pixel values; None takes the file's, or 0 to 1 if it has none.

        Raises:
            InputError: the file is missing, damaged, no ONNX or no completion network, or its metadata are
                invalid.
        """
        self.model_path, name = Path(model_path), str(model_path)
        self._session = open_session(self.model_path, modified_ns(self.model_path))
        inputs = self._session.get_inputs()
        if len(inputs) == 1 and len(inputs[0].shape) == 4 and layout_of(inputs[0].shape) is not None:
            raise InputError(
                f"{name} takes an image without depth, so it infers depth and does not complete it: name it "
                "as depth.model, not as depth.completion"
            )
        self._signature = completion_signature_of(self._session, name)
        metadata = self._session.get_modelmeta().custom_metadata_map
        values = {"width_px": SHORTEST_PX, "height_px": None, "multiple_px": MULTIPLE_PX, "kind": "metric"}
        stated = from_metadata(metadata, name)
        values |= {"normalised_inside": not stated.keys() & {"mean", "deviation"}} | stated
        if values["kind"] == "inverse" or values.get("depth_range_m") is not None:
            raise InputError(f"{name} gives disparity by its metadata; try a network that gives depth")
        values |= flagged(Overrides(normalisation=normalisation))
        self._convention = in_graph(values, self._signature.image, None, name)
        self._unit_m = _unit_m(metadata, name)

    @classmethod
    def of(cls, config: DepthConfig) -> OwnCompletion:
        """Load the network that the settings name; raises the errors of the constructor."""
        assert config.completion is not None
        return cls(config.completion, config.completion_normalisation)

    @property
    def provider(self) -> str:
        """The execution provider that runs the network."""
        return self._session.get_providers()[0]

    @property
    def description(self) -> dict[str, str]:
        """The file's metadata."""
        return dict(self._session.get_modelmeta().custom_metadata_map)

    def complete(self, sensor: DepthMap, rgb: ByteArray) -> CompletedDepth:
        """Extend measured depth into its holes; unknown where the network gives no depth.

        The output is scaled by the median ratio at the measured pixels. Its error, one value for the image,
        is measured: a fifth of the measured depth is hidden in squares and completed in a second run.

        Args:
            sensor: (H, W) metric depth with holes; at least one pixel is measured.
            rgb: (H, W, 3) uint8 colours on the same grid.

        Raises:
            InputError: the images differ in size, no pixel is measured, or the network cannot process them.
            ReconstructionError: its output is no depth, or does not follow the measured depth.
        """
        require_same_grid(sensor, rgb)
        with _one_at_a_time:
            log_z = self._scaled(self._run(sensor, rgb), sensor)
            log_scale = self._log_scale(sensor, rgb)
        met_m = meeting(log_z, sensor, rgb)
        return CompletedDepth(
            DepthMap(np.where(sensor.valid, sensor.z_m, met_m).astype(np.float32)),
            np.full(log_z.shape, log_scale, np.float32),
            fine=True,
        )

    def _log_scale(self, sensor: DepthMap, rgb: ByteArray) -> float:
        """Return the log of the mean absolute error of logarithmic depth in hidden squares; the upper end of
        ``LOG_SCALES`` if it is unknown.
        """
        hidden = hidden_squares(sensor.valid)
        rest = DepthMap(np.where(hidden, np.float32(np.nan), sensor.z_m))
        if not rest.valid.any():
            return LOG_SCALES[1]
        log_z = self._scaled(self._run(rest, rgb), rest)
        error = np.abs(log_z[hidden] - np.log(sensor.z_m[hidden]))
        known = error[np.isfinite(error)]
        if not len(known):
            return LOG_SCALES[1]
        return float(np.clip(np.log(max(float(known.mean()), 1e-9)), *LOG_SCALES))

    def _run(self, sensor: DepthMap, rgb: ByteArray) -> FloatArray:
        """Return the network's (H, W) depth in its own unit; NaN where it gives none."""
        signature, convention = self._signature, self._convention
        image, rows, columns = network_image(rgb, convention, crop=False)
        z = np.where(sensor.valid, sensor.z_m / self._unit_m, 0.0).astype(np.float32)
        plane = on_grid(z, (columns, rows), image.shape[:2])
        tensor = network_input(image, convention)
        if signature.depth is None:
            axis = 3 if convention.layout == "NHWC" else 1
            tensor = np.concatenate([tensor, np.expand_dims(plane[None], axis)], axis)
        tensors = {signature.image.input_name: tensor.astype(signature.image.dtype, copy=False)}
        if signature.depth is not None:
            tensors[signature.depth.name] = signature.depth.tensor(plane)
        if signature.mask is not None:
            tensors[signature.mask.name] = signature.mask.tensor(plane > 0.0)
        output = run_network(self._session, self.model_path, signature.image.output_name, tensors)
        output = np.where(np.isfinite(output), output, np.float32(np.nan))
        whole = cv2.resize(output, image.shape[1::-1]) if output.shape != image.shape[:2] else output
        return depth_of(unpad(whole, rows, columns), rgb.shape[1::-1], convention)

    def _scaled(self, z: FloatArray, sensor: DepthMap) -> FloatArray:
        """Return the logarithm of (H, W) depth after scaling to the measured depth.

        Raises:
            ReconstructionError: there is no depth at measured pixels, or it does not follow theirs.
        """
        both = sensor.valid & np.isfinite(z)
        if not both.any():
            raise ReconstructionError(
                f"{self.model_path} gives no positive depth where the sensor has measured: try another "
                "network"
            )
        ratio = np.log(sensor.z_m[both]) - np.log(z[both])
        shift = float(np.median(ratio))
        deviation = float(np.median(np.abs(ratio - shift)))
        if deviation > LARGEST_DEVIATION:
            raise ReconstructionError(
                f"The output of {self.model_path} does not follow the measured depth: half of the "
                f"pixels differ by more than {np.expm1(deviation):.0%} after scaling. Try another "
                "depth.completion_normalisation, or another network"
            )
        return np.log(z) + np.float32(shift)


def completed_by(config: DepthConfig, sensor: DepthMap, rgb: ByteArray) -> CompletedDepth:
    """Complete depth with the network that the settings name, or with the one that ships.

    Raises:
        InputError, ReconstructionError: as ``complete`` and ``OwnCompletion``.
    """
    if config.completion is None:
        return complete(sensor, rgb)
    return OwnCompletion.of(config).complete(sensor, rgb)


def on_grid(plane: FloatArray, size_px: tuple[int, int], shape: tuple[int, ...]) -> FloatArray:
    """Resize a plane to (width, height) by nearest pixels, and centre it in (H, W) zeros."""
    small = cv2.resize(plane, size_px, interpolation=cv2.INTER_NEAREST_EXACT)
    whole = np.zeros(shape, np.float32)
    unpad(whole, size_px[1], size_px[0])[:] = small
    return whole


def hidden_squares(valid: BoolArray) -> BoolArray:
    """Return an (H, W) mask of the measured pixels in every fifth square; these squares share no side."""
    side_px = max(1, round(valid.shape[1] / PATCHES_ACROSS))
    row, column = (np.arange(count) // side_px for count in valid.shape)
    return valid & ((row[:, None] + 2 * column) % 5 == 0)


def _unit_m(metadata: Mapping[str, str], name: str) -> float:
    text = metadata.get("depth_unit_m", "1")
    try:
        unit_m = float(text)
    except ValueError:
        unit_m = 0.0
    if not 0.0 < unit_m < inf:
        raise InputError(f"{name} says depth_unit_m = '{text}' in its metadata; try 1 for metres")
    return unit_m
