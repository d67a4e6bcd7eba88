"""Images to send, and what loss does to their packets."""

import cv2
import numpy as np
from hypothesis import strategies as st

from pipeline.delivery.coding import Coding, Images, Received


def smooth_images(height: int, width: int, seed: int, hole_share: float = 0.2) -> Images:
    """A slanted, noisy depth with holes, and a colour that a JPEG can hold well."""
    rng = np.random.default_rng(seed)
    rows, columns = np.mgrid[:height, :width]
    depth = 1500 + 3 * rows + 2 * columns + rng.integers(-4, 5, (height, width))
    holes = cv2.blur(rng.random((height, width)).astype(np.float32), (5, 5))
    depth[holes <= np.quantile(holes, hole_share)] = 0
    rgb = np.stack([rows % 256, columns % 256, (rows + columns) % 256], axis=-1).astype(np.uint8)
    return Images(cv2.blur(rgb, (9, 9)).reshape(height, width, 3), depth.astype(np.uint16))


def noise_images(height: int, width: int, seed: int) -> Images:
    """Every value possible, half of the depths missing."""
    rng = np.random.default_rng(seed)
    depth = rng.integers(0, 1 << 16, (height, width)) * (rng.random((height, width)) < 0.5)
    return Images(rng.integers(0, 256, (height, width, 3)).astype(np.uint8), depth.astype(np.uint16))


IMAGES = st.builds(
    lambda make, height, width, seed: make(height, width, seed),
    st.sampled_from([smooth_images, noise_images]),
    st.integers(1, 75),
    st.integers(1, 75),
    st.integers(0, 1000),
)
PACKET_BYTES = st.sampled_from([1, 5, 40, 108, 1464, 100_000])


def received(
    coding: Coding, images: Images, packet_bytes: int, packet_arrived, data: bytes | None = None
) -> Received:
    """Decoded from the packets for which ``packet_arrived(count)`` is true."""
    stream = np.frombuffer(data or coding.encode(images, packet_bytes), np.uint8)
    packets = np.asarray(packet_arrived(-(-stream.size // packet_bytes)), bool)
    arrived = np.repeat(packets, packet_bytes)[: stream.size]
    shape = (images.depth.shape[0], images.depth.shape[1])
    return coding.decode(np.where(arrived, stream, 0).astype(np.uint8), arrived, shape, packet_bytes)
