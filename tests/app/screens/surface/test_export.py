"""What is taken along of the surface is what is shown of it."""

from __future__ import annotations

import base64
import io
import json
import re
import shlex
from dataclasses import replace

import cv2
import numpy as np
import pytest
from PIL import Image

from app.compute.records import ColorBar
from app.compute.state import Spec
from app.drawing.colors import BACKGROUND, DISTANCE_STOPS, INFERRED, LOSS, TARGET, css
from app.drawing.legend import Legend
from app.reports.captioned import captioned
from app.screens.surface.export import surface_offers
from app.screens.surface.export_job import (
    MOST_PICTURES,
    flight,
    flight_job,
    page_job,
    sentence_of,
    view_job,
)
from app.screens.surface.labels import AFTER, POISSON
from app.screens.surface.paint_job import colored_glb
from packetmesh.errors import InputError
from packetmesh.progress import drain
from packetmesh.settings import with_settings
from pipeline.config import PipelineConfig
from pipeline.kernels.geometry import rigid
from pipeline.kernels.rays import Camera
from pipeline.sources import Demo
from pipeline.types import Rig
from tests.app.screens.fuse.walks import CAMERA, walk

SPEC = Spec(Demo("box-on-table"), config=with_settings(PipelineConfig(), ["surface.max_points=3000"]))


def record(page):
    return json.loads(re.search(r'id="record">(.*?)</script>', page)[1])


def block(page, name):
    return base64.b64decode(re.search(rf'id="{name}">([^<]*)<', page)[1])


@pytest.fixture(scope="module")
def page(store):
    return drain(page_job(store, SPEC, "source")).decode()


def test_the_page_holds_both_surfaces_as_the_app_draws_them(page, store):
    rig, placement = drain(store.stages(SPEC, "rig", "placement"))
    for row, which in enumerate(("before", "after")):
        surface = drain(store.stage(SPEC, which))
        assert block(page, f"mesh-{row}") == colored_glb(surface, "source", rig, placement)


def test_the_page_says_whose_it_is_what_differs_and_what_colours_mean(page, store):
    assert "<title>box-on-table · PacketMesh</title>" in page
    told = record(page)
    surfaces = (drain(store.stage(SPEC, which)) for which in ("before", "after"))
    before, after = (surface.quality.no_hit_ray_share for surface in surfaces)
    notes = [(side["name"], side["note"].split(" %")[0]) for side in told["sides"]]
    assert notes == [("Before fusion", f"{100 * before:.1f}"), ("After fusion", f"{100 * after:.1f}")]
    assert [one["color"] for one in told["legend"]["swatches"]] == [css(TARGET), css(INFERRED)]
    assert not re.search("https?:", page)


def test_a_baseline_stands_beside_the_balls_surface(store):
    page = drain(page_job(store, replace(SPEC, shown="poisson"), "color")).decode()
    assert [side["name"] for side in record(page)["sides"]] == ["After fusion", "Poisson surface"]


def test_nothing_is_no_page(store):
    nothing = with_settings(SPEC.config, ["surface.radius_rule=manual", "surface.radii_m=0.0001"])
    with pytest.raises(InputError, match="larger ball"):
        drain(page_job(store, replace(SPEC, config=nothing), "photo"))


def test_a_flight_goes_to_the_last_camera_and_back(store, monkeypatch):
    monkeypatch.setattr("app.screens.surface.export_job.PICTURE_WIDTH_PX", 120)
    monkeypatch.setattr("app.screens.surface.export_job.MOST_PICTURES", 6)
    film = Image.open(io.BytesIO(drain(flight_job(store, SPEC, "photo"))))
    (rig,) = drain(store.stages(SPEC, "rig"))
    legs = max(len(rig.frames) - 1, 2 if len(rig.frames) == 1 else 1)
    there = legs * max(2, 6 // legs) + 1
    assert film.n_frames == 2 * there - 2
    pictures = []
    for index in (0, there - 1, there - 2, there):
        film.seek(index)
        pictures.append(np.asarray(film.convert("RGB")).astype(int))
    assert np.abs(pictures[0] - pictures[1]).mean() > 5.0
    np.testing.assert_array_equal(pictures[2], pictures[3])  # the way back


@pytest.mark.parametrize("count", [2, 3, 16, 17, 18, 40, 300])
def test_a_flight_past_many_cameras_is_not_longer(count):
    """It flies along a straight line of cameras, whose ends it reaches, and never back."""
    cameras = [Camera(CAMERA, rigid(np.eye(3), np.array([float(row), 0.0, 0.0]))) for row in range(count)]
    x_m = [camera.T_world_camera[0, 3] for camera in flight(cameras, None)]
    assert len(x_m) <= MOST_PICTURES + 1
    assert (x_m[0], x_m[-1]) == (0.0, count - 1.0)
    assert np.all(np.diff(x_m) > 0.0)
    assert len(x_m) > 2 * min(count - 1, MOST_PICTURES // 2)


@pytest.mark.parametrize(
    ("frames", "walked", "source"),
    [(1, False, "one camera node"), (3, False, "3 camera nodes"), (12, True, "one walking camera")],
)
def test_the_page_names_the_cameras_that_the_surface_is_from(frames, walked, source):
    rig = Rig("a room", (None,) * frames, walk=walk() if walked else None)
    assert sentence_of(rig) == f"A surface made from the images of {source}. Drag the line to compare."


def test_the_view_has_the_apps_background_and_a_title_above(store):
    rgba = np.zeros((300, 640, 4), np.uint8)
    rgba[100:200, 200:300] = (10, 200, 30, 255)
    picture = cv2.imdecode(np.frombuffer(drain(view_job(store, SPEC, "photo", True, rgba)), np.uint8), 1)[
        ..., ::-1
    ]
    assert picture.shape[1] == 640
    head = next(row for row in range(100) if tuple(picture[row, -1]) == BACKGROUND)
    assert (picture[:head] < 100).any()
    np.testing.assert_array_equal(picture[head + 150, 250], (10, 200, 30))
    assert LOSS in {tuple(color) for color in picture[head + 300 :].reshape(-1, 3).tolist()}


def test_a_legend_shows_its_colours_below_the_picture():
    grey = np.full((100, 700, 3), 128, np.uint8)
    bar = captioned(grey, "t", "n", Legend(bar=ColorBar(DISTANCE_STOPS, ("0", "10 cm"))))
    swatch = captioned(grey, "t", "n", Legend(swatches=(("measured", TARGET), ("inferred", INFERRED))))
    plain = captioned(grey, "t", "n", Legend())
    colors = {tuple(color) for color in np.asarray(bar).reshape(-1, 3).tolist()}
    assert {DISTANCE_STOPS[0], DISTANCE_STOPS[-1]} <= colors
    assert {TARGET, INFERRED} <= {tuple(color) for color in np.asarray(swatch).reshape(-1, 3).tolist()}
    assert plain.height < bar.height


def test_a_baseline_is_offered_in_the_colours_it_is_drawn_in():
    assert surface_offers(AFTER, "photographs", True).files[0].arguments == ("photo",)
    assert surface_offers(POISSON, "photographs", True).files[0].arguments == ("color",)


def test_the_command_makes_the_surface_that_is_shown():
    assert "--baseline" not in SPEC.command()
    words = shlex.split(replace(SPEC, shown="alpha").command())
    assert words[words.index("--baseline") + 1] == "alpha"
