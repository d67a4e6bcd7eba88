"""The depth network at run time: one RGB image to one dense depth map, through onnxruntime."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import onnxruntime

from pipeline.depth.preprocessing import (
    CROP_HEIGHT_PX,
    CROP_WIDTH_PX,
    HEIGHT_PX,
    PADDED_HEIGHT_PX,
    WIDTH_PX,
    centre_crop,
    fitted,
    normalised_input,
    unpad,
)
from pipeline.errors import InputError
from pipeline.types import ByteArray, DepthMap

SHIPPED_MODEL = Path(__file__).resolve().parents[2] / "assets" / "depth" / "resnet50.onnx"
PREFERRED_PROVIDERS = ("CUDAExecutionProvider", "CPUExecutionProvider")
INPUT_SHAPE = [1, 3, PADDED_HEIGHT_PX, WIDTH_PX]
OUTPUT_SHAPE = [1, 1, PADDED_HEIGHT_PX, WIDTH_PX]
THREADS = 2


class DepthNetwork:
    """A loaded network; build it once and infer many images, from any thread."""

    def __init__(self, model_path: str | Path | None = None) -> None:
        """Load the ONNX file; None takes the one that ships.

        Raises:
            InputError: the file is missing, is not ONNX, is damaged, or is another kind of network.
        """
        self.model_path = SHIPPED_MODEL if model_path is None else Path(model_path)
        self._session = open_session(self.model_path)
        self._input = self._session.get_inputs()[0].name

    @property
    def provider(self) -> str:
        """The execution provider that really runs the network."""
        return self._session.get_providers()[0]

    @property
    def description(self) -> dict[str, str]:
        """What the file says about its own training: seed, images seen, errors on held-out rooms."""
        return dict(self._session.get_modelmeta().custom_metadata_map)

    def infer(self, rgb: ByteArray, crop: bool = False) -> DepthMap:
        """Relative depth on the pixel grid of ``rgb`` (SPEC 3.2).

        Args:
            rgb: (H, W, 3) uint8, any size.
            crop: infer the thesis's 304 x 228 centre crop only; NaN outside of it.

        Raises:
            InputError: ``rgb`` is not an 8-bit colour image.
        """
        if rgb.ndim != 3 or rgb.shape[2] != 3 or rgb.dtype != np.uint8 or not rgb.size:
            raise InputError(
                f"Depth is inferred from an 8-bit RGB image (H, W, 3), not from {rgb.dtype} {rgb.shape}: "
                "convert the image first."
            )
        window = centre_crop(*rgb.shape[:2]) if crop else (slice(None), slice(None))
        region = rgb[window]
        limit = (CROP_WIDTH_PX, CROP_HEIGHT_PX) if crop else (WIDTH_PX, HEIGHT_PX)
        small = fitted(region, *limit)
        (output,) = self._session.run(None, {self._input: normalised_input(small)})
        log_depth = np.log(unpad(output[0, 0], *small.shape[:2]))
        z_m = np.full(rgb.shape[:2], np.nan, np.float32)
        z_m[window] = np.exp(cv2.resize(log_depth, region.shape[1::-1], interpolation=cv2.INTER_LINEAR))
        return DepthMap(z_m, kind="relative")


def open_session(model_path: Path) -> onnxruntime.InferenceSession:
    """A session with few, non-spinning threads, checked to be a depth network of ours."""
    if not model_path.is_file():
        raise InputError(f"There is no depth network at {model_path}: name an ONNX file, or none at all.")
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = THREADS
    options.inter_op_num_threads = 1
    options.add_session_config_entry("session.intra_op.allow_spinning", "0")
    options.log_severity_level = 4
    available = onnxruntime.get_available_providers()
    providers = [name for name in PREFERRED_PROVIDERS if name in available]
    try:
        session = onnxruntime.InferenceSession(str(model_path), options, providers=providers)
    except Exception as error:  # onnxruntime raises a dozen unrelated types for damaged files
        raise InputError(
            f"{model_path} is not a readable ONNX network, or is cut short: export or download it again."
        ) from error
    shapes = [[node.shape for node in nodes] for nodes in (session.get_inputs(), session.get_outputs())]
    if shapes != [[INPUT_SHAPE], [OUTPUT_SHAPE]]:
        raise InputError(
            f"{model_path} maps {shapes[0]} to {shapes[1]}, but a depth network of PacketMesh maps "
            f"{INPUT_SHAPE} to {OUTPUT_SHAPE}: give one made by pipeline.depth.training export."
        )
    return session
