"""Make pictures of docs/ again: ``python -m tests.browser.pictures [fuse] [walk] [surface] ...``.

``kinect`` reconstructs the two real frames of ``--frames``, a folder with ``kinect_desk`` and
``kinect_basket``; the others open the app in Chromium.
"""

from __future__ import annotations

import argparse
import os
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
from PIL import Image
from playwright.sync_api import Page, sync_playwright

import packetmesh as pm
from app.drawing.colors import INFERRED, TARGET
from app.server import build_server
from lab.claims.depth.scenes import DATA
from pipeline.kernels.rays import Camera
from pipeline.surface.pictures import mesh_picture
from pipeline.types import PointSource
from tests.browser.conftest import ARGUMENTS, chromium_path
from tests.browser.hands import canvas, go, press, unfold

DOCS = Path(__file__).parents[2] / "docs"
WINDOW_PX = {"width": 1400, "height": 860}
PANEL_PX, TITLE_PX = (400, 300), 24
QUALITY = 88
FRAMES = ("kinect_desk", "kinect_basket")


def fuse(frames: Path) -> Image.Image:
    """The end of the race in the living room."""

    def to_the_end(page: Page) -> None:
        page.locator(".packetmesh-board .number").first.wait_for()
        page.locator(".packetmesh-dock-row").press("End")
        page.locator(".packetmesh-board [data-state=arrived]").wait_for()

    return _screen("Fuse", to_the_end)


def walk(frames: Path) -> Image.Image:
    """The walk through the living room, three quarters of the way."""

    def there(page: Page) -> None:
        page.locator(".packetmesh-dock-row .names").get_by_text("frame 150").wait_for()

    return _screen("", there, "living-room-walk", "screen=fuse&frame=150")


def surface(frames: Path) -> Image.Image:
    """The Surface screen with the living room."""
    return _screen("Surface", lambda page: None)


def network(frames: Path) -> Image.Image:
    """The Network screen two thirds of the way through raw images."""

    def there(page: Page) -> None:
        page.locator(".packetmesh-dock-row").get_by_text(re.compile(r"^3\.9\d* s of")).wait_for()

    return _screen("Network", there, address="screen=network&net=coding%3DRaw%2C%20depth%20first&t=3.9")


def calibrate(frames: Path) -> Image.Image:
    """The Calibrate screen with the scatter of noisier points."""

    def scatter(page: Page) -> None:
        unfold(page, "What if the points were noisier?")
        press(page, "Replay")
        page.get_by_text("All trials").wait_for(timeout=120_000)
        page.get_by_text("Lesson: How good").scroll_into_view_if_needed()

    return _screen("Calibrate", scatter, "uncalibrated")


def _screen(
    step: str, prepare: Callable[[Page], None], scene: str = "living-room", address: str = "explore"
) -> Image.Image:
    app = build_server(scene, port=0)
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium_path(), args=ARGUMENTS)
        page = browser.new_page(viewport=WINDOW_PX)
        page.goto(f"{app.url}?{address}")
        if step:
            go(page, step)
        page.get_by_text("Up to date").wait_for(timeout=120_000)
        prepare(page)
        for close in page.locator(".mantine-Notification-closeButton").all():
            close.click()
        canvas(page)
        shot = page.screenshot()
        browser.close()
    app.stop()
    return Image.fromarray(cv2.cvtColor(cv2.imdecode(np.frombuffer(shot, np.uint8), 1), cv2.COLOR_BGR2RGB))


def kinect(frames: Path) -> Image.Image:
    """A row a frame: colour image, surface before and after fusion, and what of it was inferred."""
    return Image.fromarray(np.vstack([_row(frames / name) for name in FRAMES]))


def _row(folder: Path) -> np.ndarray:
    frame = pm.load_frame(folder / "color.png", folder / "depth.png", folder / "intrinsics.json")
    result = pm.reconstruct(pm.Rig(folder.name, (frame,)))
    camera = Camera(frame.intrinsics, result.placement.T_world_camera[0])
    palette = np.array([TARGET, INFERRED], np.uint8)
    origin = replace(result.after, colors=palette[(result.after.source == PointSource.INFERRED).astype(int)])
    misses = (one.quality.no_hit_ray_share for one in (result.before, result.after))
    before, after = (f"{share:.1%}" for share in misses)
    panels = (
        ("colour image", frame.rgb),
        (f"before fusion: {before} of rays without a surface", mesh_picture(result.before, camera)),
        (f"after fusion: {after}", mesh_picture(result.after, camera)),
        ("blue: measured, violet: inferred", mesh_picture(origin, camera)),
    )
    return np.hstack([_panel(*panel) for panel in panels])


def _panel(title: str, rgb: np.ndarray) -> np.ndarray:
    width, height = PANEL_PX
    panel = np.full((height + TITLE_PX, width + 4, 3), 255, np.uint8)
    panel[TITLE_PX:, 2:-2] = cv2.resize(rgb, PANEL_PX, interpolation=cv2.INTER_AREA)
    cv2.putText(panel, title, (4, 17), cv2.FONT_HERSHEY_SIMPLEX, 0.45, (0, 0, 0), 1, cv2.LINE_AA)
    return panel


PICTURES = {
    "fuse": fuse,
    "walk": walk,
    "surface": surface,
    "network": network,
    "calibrate": calibrate,
    "kinect": kinect,
}


def main() -> None:
    """Make the named pictures, or all."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", default=list(PICTURES), help=" or ".join(PICTURES))
    data = Path(os.environ.get("PACKETMESH_SHARED_DATA", DATA))
    parser.add_argument("--frames", type=Path, default=data, help="folder with the real frames")
    options = parser.parse_args()
    for name in options.names:
        PICTURES[name](options.frames).save(DOCS / f"{name}.jpg", quality=QUALITY)


if __name__ == "__main__":
    main()
