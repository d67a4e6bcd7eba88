"""The look as text, and which side of its cuts is kept."""

import numpy as np
import pytest

from app.looking.look import Box, Look, Plane, Top, kept, look_of, planes_of, text_of
from app.looking.rays import entering
from packetmesh.errors import InputError

LOOKS = {
    "": Look(),
    "top_2350": Look(Top(2.35)),
    "plane_2500_-1800_900_0_0_-1000~wire": Look(Plane((2.5, -1.8, 0.9), (0.0, 0.0, -1.0)), wire=True),
    "box_1000_2000_500_2000_1000_1000_30~points_8~ruler": Look(
        Box((1.0, 2.0, 0.5), (2.0, 1.0, 1.0), 30.0), point_mm=8, ruler=True
    ),
    "out_0_0_0_100_100_100_-90~light_120_35": Look(
        Box((0.0, 0.0, 0.0), (0.1, 0.1, 0.1), -90.0, inside=True), light_deg=(120, 35)
    ),
}


@pytest.mark.parametrize("text", LOOKS)
def test_a_look_is_the_same_in_an_address(text):
    assert look_of(text) == LOOKS[text]
    assert text_of(LOOKS[text]) == text


@pytest.mark.parametrize(
    "text",
    [
        "ceiling",
        "top",
        "top_1_2",
        "top_1.5",
        "top_12345678",
        "top_1~top_2",
        "top_1~plane_0_0_0_0_0_1000",
        "plane_0_0_0_0_0_0",
        "box_0_0_0_100_0_100_0",
        "box_0_0_0_100_100_100_91",
        "points_41",
        "points_-1",
        "light_181_0",
        "light_0_91",
        "wire_1",
        "~".join(["wire", "wire"]),
    ],
)
def test_other_texts_are_refused_with_an_example(text):
    with pytest.raises(InputError, match="try one such as") as caught:
        look_of(text)
    look_of(str(caught.value).rpartition(" ")[2])  # which works


def test_what_is_above_a_height_behind_a_plane_or_outside_a_box_is_left_out():
    points_m = np.array([[0.0, 0.0, 0.1], [0.0, 0.0, 0.3], [0.9, 0.0, 0.1]])
    assert kept(Top(0.2), points_m).tolist() == [True, False, True]
    assert kept(Plane((0.5, 0.0, 0.0), (1.0, 0.0, 0.0)), points_m).tolist() == [False, False, True]
    box = Box((0.0, 0.0, 0.1), (2.0, 0.2, 0.2))
    assert kept(box, points_m).tolist() == [True, False, True]
    assert kept(Box(box.centre_m, box.size_m, inside=True), points_m).tolist() == [False, True, False]
    assert kept(Box(box.centre_m, box.size_m, 90.0), points_m).tolist() == [True, False, False]
    assert kept(None, points_m).all()


def test_a_box_turns_from_x_towards_y():
    box = Box((1.0, 1.0, 0.0), (2.0, 0.2, 0.2), 30.0)
    tip_m = np.array([1.0, 1.0, 0.0]) + 0.99 * np.array([np.cos(np.pi / 6), np.sin(np.pi / 6), 0.0])
    assert kept(box, tip_m[None]).all()
    assert not kept(box, (tip_m * [1.0, -1.0, 1.0] + [0.0, 2.0, 0.0])[None]).any()
    for point_m, normal in planes_of(box):
        assert (np.array(box.centre_m) - point_m) @ normal > 0.0


RAY = np.array([0.0, -5.0, 0.5]), np.array([0.0, 2.0, 0.0])


def test_a_ray_begins_where_it_enters_what_is_kept():
    front = Plane((0.0, -1.0, 0.0), (0.0, 1.0, 0.0))
    assert entering(front, *RAY) == pytest.approx([0.0, -1.0, 0.5])
    assert entering(Plane((0.0, -1.0, 0.0), (0.0, -1.0, 0.0)), *RAY) == pytest.approx(RAY[0])
    assert entering(Top(0.4), *RAY) is None
    assert entering(Top(0.6), *RAY) == pytest.approx(RAY[0])
    box = Box((0.0, 1.0, 0.5), (1.0, 1.0, 1.0))
    assert entering(box, *RAY) == pytest.approx([0.0, 0.5, 0.5])
    assert entering(Box((3.0, 1.0, 0.5), (1.0, 1.0, 1.0)), *RAY) is None
    assert entering(Box((0.0, -8.0, 0.5), (1.0, 1.0, 1.0)), *RAY) is None  # behind the viewer
    assert entering(None, *RAY) == pytest.approx(RAY[0])


def test_a_ray_out_of_a_cut_off_inside_begins_at_its_far_side():
    around = Box((0.0, -5.0, 0.5), (1.0, 1.0, 1.0), inside=True)
    assert entering(around, *RAY) == pytest.approx([0.0, -4.5, 0.5])
    assert entering(Box((0.0, 0.0, 0.5), (1.0, 1.0, 1.0), inside=True), *RAY) == pytest.approx(RAY[0])
