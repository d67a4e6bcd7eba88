"""The look as text."""

import pytest

from app.compute.cuts import Box, Plane, Top
from app.looking.look import Look, look_of, text_of
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
