"""Written reports: self-contained pages whose pictures show what a camera would see."""

import re

import numpy as np
import pytest

from app.drawing.colors import HOLE
from app.reports.html import page, picture, table
from app.reports.reproduction import write_reproduction_report
from lab.claims.claim import Verdict
from pipeline.kernels.rays import Camera
from pipeline.surface.pictures import mesh_picture
from pipeline.surface.quality import measure_quality
from pipeline.types import CameraIntrinsics, SurfaceResult

CAMERA = Camera(CameraIntrinsics.pinhole(50, 50, 49.5, 49.5, 100, 100), np.eye(4))


def half_wall(color=(200, 100, 50)) -> SurfaceResult:
    """A wall 1 m away that covers the left half of the view."""
    vertices_m = np.array([[-2.0, -2, 1], [0, -2, 1], [0, 2, 1], [-2, 2, 1]])
    triangles = np.array([[0, 2, 1], [0, 3, 2]], np.int32)
    quality = measure_quality(vertices_m, triangles, [CAMERA], 4)
    return SurfaceResult(vertices_m, triangles, np.tile(np.uint8(color), (4, 1)), (0.1,), quality=quality)


def test_rays_that_hit_nothing_are_magenta_and_only_they():
    rgb = mesh_picture(half_wall(), CAMERA)
    hole = np.all(rgb == HOLE, axis=2)
    assert hole[:, 50:].all()
    assert not hole[:, :50].any()
    assert hole.mean() == pytest.approx(half_wall().quality.no_hit_ray_share)


def test_vertex_colours_show_and_a_head_on_wall_is_fully_lit():
    np.testing.assert_allclose(mesh_picture(half_wall(), CAMERA)[50, 45], (200, 100, 50), atol=2)


def test_without_colours_the_shape_is_grey():
    pixel = mesh_picture(half_wall(), CAMERA, colored=False)[50, 45]
    assert pixel.min() == pixel.max() > 200


def test_text_from_outside_cannot_become_markup():
    assert "<script>" not in table(("<script>",), [("<script>alert(1)</script>", 1.0)])
    assert "<script>" not in page("<script>", "")
    assert '"><' not in picture(np.zeros((2, 2, 3), np.uint8), '"><b>')[:60]


@pytest.mark.parametrize(
    ("value", "text"),
    [(0.123456, "0.1235"), (9999.4, "9999"), (9999.7, "10,000"), (5.5e6, "5,500,000"), (12345, "12,345")],
)
def test_a_large_number_has_no_power_of_ten(value, text):
    assert f"<td>{text}</td>" in table(("name", "value"), [("a", value)])


def test_the_reproduction_report_counts_what_was_reproduced(tmp_path):
    verdicts = [
        Verdict(id_, "claim", "thesis", "tolerance", {"x": 0.5}, {"x": (0.4, 0.6)}, verdict, "why")
        for id_, verdict in (
            ("C1", "reproduced"),
            ("C2", "not reproduced"),
            ("C3", "true by definition"),
            ("C4", "cannot be tested"),
        )
    ]
    write_reproduction_report(verdicts, tmp_path / "r.html")
    text = (tmp_path / "r.html").read_text()
    words = "1 reproduced, 1 not reproduced, 1 true by definition, 1 cannot be tested"
    assert f"Claims: {words}." in text
    assert text.count('class="reproduced"') == text.count('class="not-reproduced"') == 1
    assert "0.4 to 0.6" in text
    assert "beyond the thesis" not in text


def test_claims_of_ours_stand_apart_from_the_thesis_s(tmp_path):
    verdicts = [
        Verdict(id_, f"claim {id_}", "thesis", "tolerance", {}, {}, verdict, "why")
        for id_, verdict in (("C1", "reproduced"), ("D1", "does not hold"), ("D2", "holds"))
    ]
    write_reproduction_report(verdicts, tmp_path / "r.html")
    text = (tmp_path / "r.html").read_text()
    heads = ("claim C1", "Our claims beyond the thesis", "claim D1", "claim D2")
    places = [text.index(words) for words in heads]
    assert places == sorted(places)
    assert "Claims: 1 reproduced." in text
    assert "Claims: 1 holds, 1 does not hold." in text


@pytest.mark.parametrize(
    ("ids", "named"), [(("C1", "D01", "D02", "D07"), ["D01, D07"]), (("D02", "D11"), []), (("C1",), [])]
)
def test_a_note_names_the_claims_in_points_that_are_in_the_report(tmp_path, ids, named):
    verdicts = [Verdict(id_, "claim", "thesis", "tolerance", {}, {}, "holds", "why") for id_ in ids]
    write_reproduction_report(verdicts, tmp_path / "r.html")
    assert re.findall(r"In points of 100: .* in (.*?)\.</p>", (tmp_path / "r.html").read_text()) == named
