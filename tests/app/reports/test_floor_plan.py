"""The floor plan: true to scale, whole on its paper, and the same in SVG and PDF."""

import re
import xml.etree.ElementTree as ET
from dataclasses import replace

import numpy as np
import pytest

from app.drawing.colors import DELIVERED, LOSS, TARGET, css
from app.reports.floor_plan import A3_MM, A4_MM, _fitted, floor_plan
from app.reports.labels import Labels
from app.reports.paper import Area, Line, Paper, Words, pdf_of, svg_of
from app.reports.plan_pictures import plan_pictures
from pipeline.planning.calls import plan
from pipeline.planning.places import floor_m
from pipeline.planning.plan import PlanConfig
from pipeline.planning.radio import PlanRadio
from pipeline.reconstruct import reconstruct
from pipeline.stages import dressed
from tests.pipeline.delivery.small import CONFIG, small_rig


@pytest.fixture(scope="module")
def done():
    return reconstruct(small_rig(), CONFIG)


@pytest.fixture(scope="module")
def planned(done):
    return plan(done, PlanConfig(cameras=3, where=("walls", "tripods")), PlanRadio(sink_m=(2.0, 1.0)))


@pytest.fixture(scope="module")
def paper(planned):
    return floor_plan(planned)


def scale_of(paper):
    (words,) = [
        shape.text for shape in paper.shapes if isinstance(shape, Words) and "Scale 1 :" in shape.text
    ]
    return int(re.search(r"1 : (\d+)", words).group(1))


def numbers_on(paper):
    """Places on the paper of the new cameras' numbers."""
    white = (255, 255, 255)
    found = [one for one in paper.shapes if isinstance(one, Words) and one.bold and one.color == white]
    return {one.text: np.array([one.x_mm, one.y_mm - 1.2]) for one in found}


def test_distances_on_paper_are_those_of_the_room_at_the_scale(planned, paper):
    scale, marks_mm = scale_of(paper), numbers_on(paper)
    cameras = planned.plan.cameras
    assert list(marks_mm) == [str(number) for number in range(1, len(cameras) + 1)]
    places_m = {str(k): one.T_world_camera[:2, 3] for k, one in enumerate(cameras, 1)}
    for name, at_mm in marks_mm.items():
        for other, there_mm in marks_mm.items():
            way_m = (there_mm - at_mm) * (1.0, -1.0) * scale / 1000.0  # y upwards in the room
            assert way_m == pytest.approx(places_m[other] - places_m[name], abs=1e-6)


def test_the_scale_bar_is_as_long_as_it_says(paper):
    scale = scale_of(paper)
    texts = [shape.text for shape in paper.shapes if isinstance(shape, Words)]
    (says,) = [re.search(r"This bar is ([\d.]+) mm", text) for text in texts if "This bar" in text]
    (length_m,) = [float(text[:-2]) for text in texts if re.fullmatch(r"[\d.]+ m", text)]
    assert float(says.group(1)) == pytest.approx(1000.0 * length_m / scale)


def test_the_table_has_every_camera_with_place_and_aim(planned, paper):
    texts = [shape.text for shape in paper.shapes if isinstance(shape, Words)]
    for camera in planned.plan.cameras:
        x_m, y_m, z_m = camera.T_world_camera[:3, 3]
        for value in (x_m, y_m, z_m - floor_m(planned.seen)):
            assert f"{value + 0.0:.2f}" in texts
    assert {"node_00", "node_01", "pan", "tilt", "height", "x (m)", "y (m)"} <= set(texts)


def test_nothing_is_outside_the_paper(planned, paper):
    away = floor_plan(replace(planned, delivery=replace(planned.delivery, sink_m=(900.0, -50.0))))
    for sheet in (paper, away):
        for shape in sheet.shapes:
            if isinstance(shape, Words):
                points_mm = np.array([[shape.x_mm, shape.y_mm]])
            else:
                points_mm = np.vstack(shape.rings_mm if isinstance(shape, Area) else [shape.points_mm])
            assert np.isfinite(points_mm).all()
            assert np.all((points_mm >= 0.0) & (points_mm <= (sheet.width_mm, sheet.height_mm)))


def test_a_sink_far_away_is_an_arrow_with_its_distance(planned, paper):
    def reds(sheet):
        return [one for one in sheet.shapes if isinstance(one, Area) and one.fill == LOSS]

    away = floor_plan(replace(planned, delivery=replace(planned.delivery, sink_m=(900.0, 1.0))))
    texts = [shape.text for shape in away.shapes if isinstance(shape, Words)]
    (says,) = [text for text in texts if text.startswith("to the sink")]
    assert 890.0 < float(re.search(r"([\d.]+) m beyond", says).group(1)) < 900.0
    assert len(reds(paper)) == len(reds(away)) == 2  # mark and legend
    assert scale_of(away) == scale_of(paper)


@pytest.mark.parametrize(
    ("width_m", "name", "scale"), [(2.0, "A4", 20), (7.0, "A4", 50), (11.0, "A3", 50), (15.0, "A4", 100)]
)
def test_a_room_gets_the_largest_scale_at_which_it_fits(width_m, name, scale):
    paper, size_mm, frame = _fitted(np.array([[0.0, 0.0], [width_m, width_m]]))
    assert (paper, frame.scale) == (name, scale)
    assert size_mm == {"A4": A4_MM, "A3": A3_MM}[name]
    corners_mm = frame.on_paper(np.array([[0.0, 0.0], [width_m, width_m]]))
    assert corners_mm[1, 1] < corners_mm[0, 1]
    assert np.ptp(corners_mm[:, 0]) == pytest.approx(1000.0 * width_m / scale)


def test_both_files_have_the_papers_size_and_svg_its_texts(paper):
    root = ET.fromstring(svg_of(paper))
    assert (root.get("width"), root.get("height")) == (f"{paper.width_mm:g}mm", f"{paper.height_mm:g}mm")
    texts = [element.text for element in root.iter("{http://www.w3.org/2000/svg}text")]
    assert texts == [shape.text for shape in paper.shapes if isinstance(shape, Words)]
    pdf = pdf_of(paper)
    box = re.search(rb"/MediaBox \[ 0 0 ([\d.]+) ([\d.]+) \]", pdf)
    assert [float(side) * 25.4 / 72.0 for side in box.groups()] == pytest.approx(
        [paper.width_mm, paper.height_mm], abs=0.01
    )
    assert pdf_of(paper) == pdf


def test_a_name_from_outside_stays_text():
    words = Words(1.0, 2.0, "<b>Büro & ห้อง</b>")
    paper = Paper("<i>", 20.0, 10.0, (words, Line(np.zeros((2, 2)), (0, 0, 0))))
    root = ET.fromstring(svg_of(paper))
    assert [element.text for element in root][:1] == ["<i>"]
    assert words.text in [element.text for element in root]
    assert pdf_of(paper).startswith(b"%PDF")


def test_labels_cover_neither_each_other_nor_a_mark():
    labels = Labels(0.0, 0.0, 100.0, 60.0)
    marks = [(50.0 + k, 30.0) for k in range(6)]
    for x_mm, y_mm in marks:
        labels.keep_free(x_mm, y_mm, 3.0)
    grounds = []
    for x_mm, y_mm in marks:
        ground, _ = labels.beside(x_mm, y_mm, 3.0, "1.50 m high", 2.8, (0, 0, 0))
        grounds.append((*ground.rings_mm[0].min(axis=0), *ground.rings_mm[0].max(axis=0)))
    squares = [(x_mm - 3.0, y_mm - 3.0, x_mm + 3.0, y_mm + 3.0) for x_mm, y_mm in marks]
    for k, one in enumerate(grounds):
        assert 0.0 <= one[0] < one[2] <= 100.0
        for other in [*grounds[:k], *squares]:
            assert one[2] < other[0] or one[0] > other[2] or one[3] < other[1] or one[1] > other[3]


def test_new_cameras_are_green_and_present_ones_blue(planned, paper):
    drawing = svg_of(paper)
    for color, count in ((DELIVERED, len(planned.plan.cameras)), (TARGET, len(planned.rig.frames))):
        assert drawing.count(f'fill-opacity="0.1" stroke="{css(color)}"') == count


def test_a_picture_is_green_where_its_camera_adds_something(done, planned):
    texture = dressed(done.rig, done.placement, done.after)
    shares = []
    for rgb in plan_pictures(planned.seen, planned.plan, texture):
        assert rgb.shape == (420, 560, 3)
        away = np.linalg.norm(rgb.astype(float) - np.array(DELIVERED), axis=2)
        shares.append(float((away < 60.0).mean()))
    assert shares[0] > 0.01
    assert shares[0] == max(shares)
