"""Make the small pictures of the landing screen again: ``python tests/browser/landing_pictures.py``.

They are cut from the pictures of docs/ and made of what the cameras of the demo scenes deliver.
"""

from __future__ import annotations

import io
from pathlib import Path

import cv2
import numpy as np
from PIL import Image, ImageFile

from app.drawing.colors import GHOST
from app.landing import PICTURES
from packetmesh.progress import drain
from pipeline.io.demos import DEMO_SCENES, DEMO_WALKS, SCENES
from pipeline.kernels.geometry import apply, inverse, look_at, project
from pipeline.sources import demo_of
from pipeline.stages import open_rig
from pipeline.types import CameraIntrinsics

DOCS = Path(__file__).parents[2] / "docs"
SIZE_PX = (320, 200)
QUALITY = 80
CUTS_PX = {
    "how-good-is-my-calibration": ("calibrate", (310, 130, 710, 380)),
    "icp-against-ceicp": ("fuse", (0, 0, 950, 594)),
    "which-ball-radius": ("surface", (150, 180, 870, 630)),
    "how-images-cross-a-network": ("network", (100, 120, 760, 533)),
    "how-a-walk-becomes-a-room": ("walk", (160, 50, 864, 490)),
}
"""Picture of docs/, and left, top, right and bottom of the piece that is shown."""
EYE_M = (-1.8, -4.2, 5.4)
"""Place from which a walk's map is shown, relative to its middle."""
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


def missed(scene: str) -> Image.Image:
    """The photograph, with the colour of ghosts where the depth sensor measured nothing."""
    depth = cv2.imread(str(SCENES / scene / "node_00" / "depth.png"), cv2.IMREAD_UNCHANGED)
    picture = np.array(photograph(scene).resize((depth.shape[1], depth.shape[0])))
    picture[depth == 0] = GHOST
    return Image.fromarray(picture)


def cut_short(scene: str) -> Image.Image:
    """The photograph as a JPEG whose last packets never came."""
    whole = io.BytesIO()
    photograph(scene).save(whole, "JPEG")
    came = whole.getvalue()[: int(SHARE_ARRIVED * whole.tell())]
    ImageFile.LOAD_TRUNCATED_IMAGES = True
    return Image.open(io.BytesIO(came)).convert("RGB")


def walked(name: str) -> Image.Image:
    """The map of a walk, obliquely from above without the surfaces that face away, and the camera's path."""
    walk = drain(open_rig(demo_of(name))).walk
    camera = CameraIntrinsics.pinhole(800.0, 800.0, 479.5, 299.5, 960, 600)
    points_m, path_m = walk.map.points_m, np.array([T[:3, 3] for T in walk.T_world_camera if T is not None])
    middle_m = 0.5 * (points_m.min(axis=0) + points_m.max(axis=0))
    T_world_eye = look_at(middle_m + EYE_M, middle_m)
    facing = np.einsum("nk,nk->n", walk.map.normals, T_world_eye[:3, 3] - points_m) > 0.0
    eye_m = apply(inverse(T_world_eye), points_m[facing])
    order = np.argsort(-eye_m[:, 2])  # the nearest is drawn last
    drawn = np.full((600, 960, 3), 244, np.uint8)
    at_px = np.rint(project(camera, eye_m[order])).astype(int)
    for (u, v), rgb in zip(at_px.tolist(), walk.map.colors[facing][order].tolist(), strict=True):
        cv2.circle(drawn, (u, v), 3, rgb, -1)
    line_px = np.rint(project(camera, apply(inverse(T_world_eye), path_m))).astype(np.int32)
    cv2.polylines(drawn, [line_px], False, (255, 255, 255), 9, cv2.LINE_AA)
    cv2.polylines(drawn, [line_px], False, (208, 52, 44), 5, cv2.LINE_AA)
    return Image.fromarray(drawn)


def main() -> None:
    """Make all of them."""
    pictures = {scene: photograph(scene) for scene in DEMO_SCENES}
    pictures |= {name: walked(name) for name in DEMO_WALKS}
    pictures |= {name: Image.open(DOCS / f"{doc}.jpg").crop(box) for name, (doc, box) in CUTS_PX.items()}
    pictures["can-a-picture-measure"] = half_depth("living-room")
    pictures["what-one-lost-packet-costs"] = cut_short("living-room")
    pictures["where-should-the-camera-stand"] = missed("workshop")
    PICTURES.mkdir(exist_ok=True)
    for name, picture in pictures.items():
        width, height = picture.size
        tall = min(height, width * SIZE_PX[1] // SIZE_PX[0])
        top = (height - tall) // 2
        small = picture.crop((0, top, width, top + tall)).resize(SIZE_PX, Image.Resampling.LANCZOS)
        small.save(PICTURES / f"{name}.jpg", quality=QUALITY, optimize=True)


if __name__ == "__main__":
    main()
