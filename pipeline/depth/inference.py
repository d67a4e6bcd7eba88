"""Inference of a dense depth map from an RGB image by a depth network, through onnxruntime."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import cv2
import numpy as np

from packetmesh.errors import InputError, ReconstructionError
from pipeline.config import DepthConfig
from pipeline.depth.completion_signature import takes_depth
from pipeline.depth.conventions import Convention, Overrides, convention_of
from pipeline.depth.preprocessing import centre_crop, fitted, free_size, padded, resized, unpad
from pipeline.depth.sessions import modified_ns, open_session, run_session
from pipeline.depth.signature import signature_of
from pipeline.types import ByteArray, DepthMap, FloatArray

SHIPPED_MODEL = Path(__file__).resolve().parents[2] / "assets" / "depth" / "resnet50.onnx"


class DepthNetwork:
    """A loaded depth network, PacketMesh's or any other; one object can serve many images and threads."""

    def __init__(
        self,
        model_path: str | Path | None = None,
        preset: str | None = None,
        overrides: Overrides | None = None,
    ) -> None:
        """Load the ONNX file; None loads the network that comes with PacketMesh.

        Args:
            model_path: any depth network (``pipeline.depth.conventions``).
            preset: name in ``conventions.PRESETS``; None uses the convention in the file.
            overrides: parts of the convention that replace the file's or the preset's.

        Raises:
            InputError: the file is missing, damaged, no ONNX or no depth network, neither it nor the call
                gives its convention, or a preset of another network is given without a file.
        """
        if model_path is None and preset not in (None, "packetmesh"):
            raise InputError(f"The preset {preset} is for a network of that kind: name its ONNX file as well")
        self.model_path = SHIPPED_MODEL if model_path is None else Path(model_path)
        self._session = open_session(self.model_path, modified_ns(self.model_path))
        if takes_depth(self._session):
            raise InputError(
                f"{self.model_path} takes an image and depth, so it completes depth: name it as "
                "depth.completion (infer-depth: --completion), not as depth.model"
            )
        self._signature = signature_of(self._session, str(self.model_path))
        self.convention = convention_of(self._session, preset, overrides, str(self.model_path))

    @classmethod
    def of(cls, config: DepthConfig) -> DepthNetwork:
        """Load the network that the settings name; raises the errors of the constructor."""
        return cls(config.model, config.preset, Overrides.of(config))

    @property
    def provider(self) -> str:
        """The execution provider that runs the network."""
        return self._session.get_providers()[0]

    @property
    def description(self) -> dict[str, str]:
        """The file's metadata: its training and errors, or its convention."""
        return dict(self._session.get_modelmeta().custom_metadata_map)

    def infer(self, rgb: ByteArray, crop: bool = False) -> DepthMap:
        """Infer depth on the grid of ``rgb`` (SPEC 3.2): metric if the output is in metres, else relative.

        The output of the kind ``inverse`` is disparity d up to scale and shift; the depth is 1/d, which
        the alignment ``affine_inverse`` makes metric. Where d is zero or negative, as most networks clip
        far pixels, the depth is NaN.

        Args:
            rgb: (H, W, 3) uint8, any size.
            crop: infer only the thesis's centre crop, 304 x 228 of 320 x 240; NaN outside.

        Raises:
            InputError: ``rgb`` is not an 8-bit colour image, or the network cannot process it.
            ReconstructionError: the network's output has no positive depth.
        """
        if rgb.ndim != 3 or rgb.shape[2] != 3 or rgb.dtype != np.uint8 or not rgb.size:
            raise InputError(
                f"Depth is inferred from an 8-bit RGB image (H, W, 3), not from {rgb.dtype} {rgb.shape}: "
                "convert the image first."
            )
        window = centre_crop(*rgb.shape[:2]) if crop else (slice(None), slice(None))
        region = rgb[window]
        image, rows, columns = network_image(region, self.convention, crop)
        signature = self._signature
        given = network_input(image, self.convention).astype(signature.dtype, copy=False)
        output = run_network(
            self._session, self.model_path, signature.output_name, {signature.input_name: given}
        )
        whole = cv2.resize(output, image.shape[1::-1]) if output.shape != image.shape[:2] else output
        z = np.full(rgb.shape[:2], np.nan, np.float32)
        z[window] = depth_of(unpad(whole, rows, columns), region.shape[1::-1], self.convention)
        if not np.isfinite(z).any():
            raise ReconstructionError(
                f"{self.model_path} gives no positive depth on this image as a network of the kind "
                f"{self.convention.kind}: try another image, or another kind"
            )
        return DepthMap(z, kind="metric" if self.convention.kind == "metric" else "relative")


def run_network(
    session: Any, model_path: Path, output_name: str, tensors: dict[str, np.ndarray]
) -> FloatArray:
    """Run a network on the input of one image; returns (H, W) float32.

    Raises:
        InputError: the network cannot process the input, or gives more than one depth map.
    """
    try:
        output = run_session(session, model_path, output_name, tensors)
    except Exception as error:  # onnxruntime raises a dozen unrelated types
        reason = str(error).splitlines()[0] if str(error) else type(error).__name__
        sizes = " and ".join(str(list(tensor.shape)) for tensor in tensors.values())
        raise InputError(
            f"{model_path} fails on an input of {sizes} ({reason}): try another input size or preset"
        ) from error
    plane = output[..., 0] if output.ndim == 4 and output.shape[-1] == 1 else output
    if plane.ndim < 2 or plane.size != plane.shape[-1] * plane.shape[-2]:
        raise InputError(
            f"{model_path} gives {list(output.shape)} where one depth map is needed: give another network"
        )
    return plane.reshape(plane.shape[-2:]).astype(np.float32, copy=False)


def network_image(region: ByteArray, convention: Convention, crop: bool) -> tuple[ByteArray, int, int]:
    """Resize the image for the network; returns it with the rows and columns that are not padding."""
    rows, columns = region.shape[:2]
    width_px, height_px = convention.width_px, convention.height_px
    if height_px is None:
        width_px, height_px = free_size(columns, rows, width_px, convention.multiple_px)
    if convention.height_px is None or convention.resize == "stretch":
        return resized(region, width_px, height_px), height_px, width_px
    box = convention.fit_px or (width_px, height_px)
    if crop:  # the crop fills the same part of the box as of the image: the scale does not change
        rows_of_box, columns_of_box = centre_crop(box[1], box[0])
        box = columns_of_box.stop - columns_of_box.start, rows_of_box.stop - rows_of_box.start
    small = fitted(region, *box)
    return padded(small, width_px, height_px), *small.shape[:2]


def network_input(image: ByteArray, convention: Convention) -> FloatArray:
    """Convert an (H, W, 3) uint8 RGB image to the network's float32 tensor of one image."""
    values: FloatArray = image.astype(np.float32) / np.float32(convention.scale)
    if not convention.normalised_inside:
        mean, deviation = np.array([convention.mean, convention.deviation], np.float32)
        values = (values - mean) / deviation
    if convention.channels == "BGR":
        values = values[..., ::-1]
    return np.ascontiguousarray((values if convention.layout == "NHWC" else values.transpose(2, 0, 1))[None])


def depth_of(output: FloatArray, size_px: tuple[int, int], convention: Convention) -> FloatArray:
    """Convert a network's output to depth of (width, height) pixels.

    Depth is resized as its logarithm, disparity directly: noise is then uniform. Values <= 0 become NaN.
    """
    if convention.depth_range_m is not None:
        near, far = (1.0 / depth_m for depth_m in convention.depth_range_m)
        output = np.float32(far) + np.float32(near - far) * output
    with np.errstate(divide="ignore", invalid="ignore"):
        if convention.gives_disparity:
            disparity = cv2.resize(output, size_px, interpolation=cv2.INTER_LINEAR)
            return np.where(disparity > 0.0, 1.0 / disparity, np.float32(np.nan))
        logarithm = np.where(output > 0.0, np.log(output), np.float32(np.nan))
        return np.exp(cv2.resize(logarithm, size_px, interpolation=cv2.INTER_LINEAR))
