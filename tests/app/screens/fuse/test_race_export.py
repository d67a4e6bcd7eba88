"""A race to take along: the same numbers as on the board, on a page and in a moving picture."""

from __future__ import annotations

import base64
import io
import json
import re
import zlib
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

from app.compute.state import Spec
from app.drawing.colors import NEUTRAL
from app.reports.race import race_page
from app.reports.race_animation import race_animation
from app.screens.fuse.export import race_offers
from app.screens.fuse.export_job import race_show
from app.screens.fuse.methods import color_of
from app.screens.fuse.race_job import race_job
from app.screens.fuse.view import REACH_M, Race, Start
from packetmesh.progress import drain
from pipeline.sources import Demo

SPEC = Spec(Demo("box-on-table"))
RACE = Race(mode="inferred", source=0, target=0, start=Start((0.0, 3.0, 0.0), (5.0, 0.0, 0.0)))


@pytest.fixture(scope="module")
def view(store):
    return drain(race_job(store, SPEC, RACE))


@pytest.fixture(scope="module")
def show(view):
    return race_show(view, "a race")


def test_every_step_of_every_method_is_there_with_its_error(view, show):
    for lane, run in zip(view.lanes, show.runs, strict=True):
        assert len(run.poses) == len(run.notes) == len(run.lens) == len(lane.steps)
        assert len(run.offs_cm) == len(run.offs) == len(lane.steps)
        assert run.color == color_of(lane.rival)
        assert run.notes[-1].endswith(f"after {lane.iterations} iterations · {lane.verdict}")
    assert show.steps == max(len(lane.steps) for lane in view.lanes)


def test_a_page_draws_no_error_that_is_out_of_reach_and_gives_its_lower_limit(view):
    errors = ((None, REACH_M), (None, 0.3), (0.7, np.nan), (None, np.nan))
    (lane, *_), some = view.lanes, view.lanes[0].steps[0]
    steps = [replace(some, point_error_m=error_m, gap_m=gap_m) for error_m, gap_m in errors]
    lanes = (replace(lane, steps=tuple(steps)),)
    show = race_show(replace(view, reference="cloud", lanes=lanes), "a race")
    assert show.runs[0].offs == ("≥ 50 cm", "30.00 cm", "70.00 cm", "–")
    np.testing.assert_allclose(show.runs[0].offs_cm, [np.nan, 30.0, 70.0, np.nan])
    record = json.loads(re.search(r'id="record">(.*?)</script>', race_page(show))[1])
    assert record["runs"][0]["offs_cm"] == pytest.approx([None, 30.0, 70.0, None])


def test_the_page_holds_the_race_and_asks_for_nothing(show):
    page = race_page(show)
    assert "<title>a race · PacketMesh</title>" in page
    record = json.loads(re.search(r'id="record">(.*?)</script>', page)[1])
    packed = dict(re.findall(r'<script type="text/plain" id="([^"]+)">([^<]*)</script>', page))
    blocks = {name: zlib.decompress(base64.b64decode(text)) for name, text in packed.items()}
    places_m = np.frombuffer(blocks["source"], "<f4").reshape(-1, 3)
    np.testing.assert_allclose(places_m, show.source_m)
    for row, (run, told) in enumerate(zip(show.runs, record["runs"], strict=True)):
        assert len(blocks[f"shades-{row}"]) == len(run.poses) * len(places_m)
        pose = np.array(told["poses"][-1]).reshape(4, 4).T  # column by column, as WebGL wants it
        np.testing.assert_allclose(pose, run.poses[-1])
    assert not re.search("https?:", page)


def test_the_moving_picture_shows_the_cloud_coming_nearer(show):
    film = Image.open(io.BytesIO(race_animation(show)))
    assert 2 <= film.n_frames <= show.steps
    pictures = []
    for index in (0, film.n_frames - 1):
        film.seek(index)
        pictures.append(np.asarray(film.convert("RGB")).astype(int))
    grey = [int((np.abs(picture - NEUTRAL).max(axis=2) < 12).sum()) for picture in pictures]
    assert min(grey) > 500
    assert np.abs(pictures[0] - pictures[1]).max(axis=2).astype(bool).mean() > 0.02


def test_a_race_is_offered_with_an_honest_word_on_commands():
    offers = race_offers(RACE)
    assert all(file.arguments == (RACE,) for file in offers.files)
    assert "No command" in offers.note
    assert not offers.command
