"""C09, C11, C15 and C37 to C39: settings of the thesis, and claims that our data cannot test (SPEC 8)."""

from __future__ import annotations

import platform
from functools import partial

import psutil

from lab.claims.claim import Claim, Outcome
from lab.claims.registration.cases import CONDITIONS
from lab.claims.registration.setup import ROOMS
from network_sim.fixed.images import ppm_bytes
from network_sim.mac.ieee802154 import LINK_BPS
from pipeline.depth.preprocessing import CROP_HEIGHT_PX, CROP_WIDTH_PX
from pipeline.io.demos import DEMO_SCENES, load_demo

WIDTH_PX, HEIGHT_PX = 640, 480


def _image_size() -> Outcome:
    frames = [frame for name in DEMO_SCENES for frame in load_demo(name).frames]
    right = sum(frame.rgb.shape[:2] == frame.depth.z_m.shape == (HEIGHT_PX, WIDTH_PX) for frame in frames)
    size = ppm_bytes(WIDTH_PX, HEIGHT_PX)
    seconds = 8.0 * size / LINK_BPS
    return Outcome(
        {"frames": float(len(frames)), "seconds_an_image": seconds},
        {},
        right == len(frames),
        f"{right} of {len(frames)} images of the demo scenes have {WIDTH_PX} x {HEIGHT_PX} pixels; 30 of "
        f"them a second cross no network of the thesis, whose link takes {seconds:.0f} s for one",
    )


def _untested(why: str) -> Outcome:
    return Outcome({}, {}, None, why)


def _machine() -> Outcome:
    cores, memory_gib = psutil.cpu_count() or 1, psutil.virtual_memory().total / 2**30
    return Outcome(
        {"cores": float(cores), "memory_gib": memory_gib},
        {},
        None,
        f"we do not have that machine; this one has {cores} {platform.machine()} cores, {memory_gib:.0f} GiB "
        f"of memory and Python {platform.python_version()}, and every record names its own",
    )


CLAIMS = (
    Claim(
        "C09",
        "The cameras give colour and depth of 640 x 480 pixels",
        "3.1, 3.6: 640 x 480 pixels, 30 images a second",
        "the size of every image of the demo scenes",
        _image_size,
        by_definition=True,
    ),
    Claim(
        "C11",
        "How the depth network was trained",
        "3.3: 304 x 228 pixels, batches of 32, learning rate 2e-4, 30 epochs, 22 layers",
        "nothing that we have: its weights were not published",
        partial(
            _untested,
            f"ours takes {CROP_WIDTH_PX} x {CROP_HEIGHT_PX} pixels, too, but has seen rendered rooms instead "
            "of KITTI's streets, with a budget of time instead of epochs; a ResNet-50 has 50 layers, not 22",
        ),
    ),
    Claim(
        "C15",
        "Registration is compared on three scenarios of 100 frames",
        "4.3: 3 x 100 frames",
        "nothing that we have: its frames were not published",
        partial(
            _untested,
            f"C16 to C20 stand on {len(ROOMS)} rooms of our own, in {len(CONDITIONS)} conditions",
        ),
    ),
    Claim(
        "C37",
        "The machine of the experiments",
        "4: i7-7700HQ at 2.81 GHz, 8 GB, MATLAB 2020a, Python 3.10",
        "nothing that we have",
        _machine,
    ),
    Claim(
        "C38",
        "A fisheye camera of up to 195° can be calibrated",
        "2.2: up to 195°, as its source says",
        "nothing that we have: OpenCV's fisheye model sees less than 180°",
        partial(
            _untested, "our lens fisheye is that model, so nothing beyond 180° can be rendered or fitted"
        ),
    ),
    Claim(
        "C39",
        "Numbers of other people's work that the thesis quotes",
        "2.3: vineyards at 4.26 kbps, RICP in 8 instead of 15 iterations, a boundary fit 4.7 times faster",
        "nothing that we have: their data and programs are their authors'",
        partial(_untested, "they are quotations, of which only RICP is here, as a rival of C16"),
    ),
)
