"""The list of measures in an address: written, read back, and refused in a sentence."""

from urllib.parse import parse_qs, urlencode

import pytest

from app.compute.measures import Scale, Taken, Tape
from app.measuring.address import EXAMPLE, MOST_LETTERS, fits, name_of, tape_of, text_of
from app.measuring.kinds import KINDS, SNAPS, steps_of
from packetmesh.errors import InputError

A, B, C = (1.234, -0.567, 0.89), (-12.0, 0.001, -0.001), (0.0, 3.5, 2.25)
EDGE = Taken("distance", "edge", (A, B), name="Table, left & über")
CORNER = Taken("angle", "vertex", (A, B, C), part=2)


@pytest.mark.parametrize("kind", KINDS.values())
@pytest.mark.parametrize("snap", SNAPS.values())
def test_every_kind_is_read_back_as_it_was_written(kind, snap):
    taken = Taken(kind, snap, (A, B, C)[: len(steps_of(kind, snap))])
    assert tape_of(text_of(Tape((taken,)))) == Tape((taken,))


def test_names_nodes_and_the_scale_survive_the_way_through_a_query():
    tape = Tape((EDGE, CORNER), Scale(EDGE.unnamed, 0.2031))
    query = urlencode({"measure": text_of(tape)})
    assert tape_of(parse_qs(query)["measure"][0]) == tape
    assert tape_of("") == Tape()


def test_the_text_can_be_read():
    tape = Tape(
        (Taken("distance", "edge", (A, C), name="Table"),), Scale(Taken("distance", "edge", (A, C)), 0.2)
    )
    assert text_of(tape) == "distance~edge~1234_-567_890~0_3500_2250~.Table~t2000"
    assert len(tape_of(EXAMPLE).taken) == 1


@pytest.mark.parametrize(
    "text",
    [
        "distance",
        "length~edge~1_2_3~4_5_6",
        "distance~corner~1_2_3~4_5_6",
        "distance~edge~1_2_3",
        "distance~edge~1_2_3~4_5_6~7_8_9",
        "distance~edge~1_2_3~4_5_x",
        "distance~edge~1_2_3~4_5_99999999",
        "hole~edge~1_2_3~q",
        "hole~edge~1_2_3~~~",
        "~~",
    ],
)
def test_what_is_no_list_is_refused_with_an_example(text):
    with pytest.raises(InputError, match="try measures such as distance"):
        tape_of(text)


def test_a_list_that_is_too_long_for_an_address_is_refused():
    many = Tape(tuple(Taken("box", "plane", (A, B, C), name=str(number)) for number in range(60)))
    assert not fits(many)
    with pytest.raises(InputError, match=f"{MOST_LETTERS} letters"):
        tape_of(text_of(many))


def test_a_typed_name_has_no_letter_that_separates_and_is_short():
    assert name_of("  my~~table \n top ") == "my--table top"
    assert len(name_of(100 * "x")) == 40
