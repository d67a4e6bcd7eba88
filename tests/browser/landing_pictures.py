"""Make the small pictures of the landing screen again: ``python tests/browser/landing_pictures.py``.

They are cut from the pictures of docs/ and made of what the cameras of the demo scenes deliver.
"""

from __future__ import annotations

import io
from pathlib import Path

import cv2
import numpy as np
from PIL import Image, ImageFile

from app.landing import PICTURES
from pipeline.io.demos import DEMO_SCENES, SCENES

DOCS = Path(__file__).parents[2] / "docs"
SIZE_PX = (320, 200)
QUALITY = 80
CUTS_PX = {
    "how-good-is-my-calibration": ("calibrate", (310, 130, 710, 380)),
    "icp-against-ceicp": ("fuse", (0, 0, 950, 594)),
    "which-ball-radius": ("surface", (150, 180, 870, 630)),
    "how-images-cross-a-network": ("network", (100, 120, 760, 533)),
}
"""Picture of docs/, and left, top, right and bottom of the piece that is shown."""
SHARE_ARRIVED = 0.55
"""Of the bytes of the JPEG whose rest was lost."""


def photograph(scene: str) -> Image.Image:
    """What the first camera sees."""
    path = next(path for path in sorted((SCENES / scene / "node_00").iterdir()) if path.stem == "color")
    return Image.open(path).convert("RGB")


def half_depth(scene: str) -> Image.Image:
    """The photograph left, what the depth sensor measured right; magenta where it measured nothing."""
    depth = cv2.imread(str(SCENES / scene / "node_00" / "depth.png"), cv2.IMREAD_UNCHANGED)
    levels = np.clip(255.0 * depth / depth.max(), 0.0, 255.0).astype(np.uint8)
    colors = cv2.applyColorMap(levels, cv2.COLORMAP_VIRIDIS)[..., ::-1]
    colors[depth == 0] = (255, 0, 255)
    both = np.array(photograph(scene).resize((depth.shape[1], depth.shape[0])))
    middle = depth.shape[1] // 2
    both[:, middle:] = colors[:, middle:]
    return Image.fromarray(both)


def cut_short(scene: str) -> Image.Image:
    """The photograph as a JPEG whose last packets never came."""
    whole = io.BytesIO()
    photograph(scene).save(whole, "JPEG")
    came = whole.getvalue()[: int(SHARE_ARRIVED * whole.tell())]
    ImageFile.LOAD_TRUNCATED_IMAGES = True
    return Image.open(io.BytesIO(came)).convert("RGB")


def main() -> None:
    """Make all of them."""
    pictures = {scene: photograph(scene) for scene in DEMO_SCENES}
    pictures |= {name: Image.open(DOCS / f"{doc}.jpg").crop(box) for name, (doc, box) in CUTS_PX.items()}
    pictures["can-a-picture-measure"] = half_depth("living-room")
    pictures["what-one-lost-packet-costs"] = cut_short("living-room")
    PICTURES.mkdir(exist_ok=True)
    for name, picture in pictures.items():
        width, height = picture.size
        tall = min(height, width * SIZE_PX[1] // SIZE_PX[0])
        top = (height - tall) // 2
        small = picture.crop((0, top, width, top + tall)).resize(SIZE_PX, Image.Resampling.LANCZOS)
        small.save(PICTURES / f"{name}.jpg", quality=QUALITY, optimize=True)


if __name__ == "__main__":
    main()
