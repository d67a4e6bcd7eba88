"""The fold over a generator."""

import pytest

from packetmesh.progress import Progress, drain, part, spaced


def counting(end):
    yield from range(end)
    if end > 3:
        raise ValueError("too far")
    return end


def test_a_drained_generator_gives_its_return_value_and_hands_every_step_on():
    steps = []
    assert drain(counting(3), steps.append) == 3
    assert steps == [0, 1, 2]
    assert drain(counting(0)) == 0


def test_what_the_generator_raises_is_raised_after_the_steps_before_it():
    steps = []
    with pytest.raises(ValueError, match="too far"):
        drain(counting(5), steps.append)
    assert steps == [0, 1, 2, 3, 4]


def test_a_part_of_a_longer_computation_says_its_stage_and_in_detail_what_it_does():
    def work():
        yield Progress("reading", 0.5)
        return "done"

    for detail, stage in ((False, "camera"), (True, "camera: reading")):
        steps = []
        assert drain(part(work(), "camera", 0.2, 0.6, detail), steps.append) == "done"
        assert steps == [Progress(stage, 0.4)]


def test_reports_are_at_least_so_many_steps_apart_and_about_a_hundred():
    assert [spaced(count, 5) for count in (0, 40, 500, 599, 600, 10_000)] == [5, 5, 5, 5, 6, 100]
    assert len(range(0, 10_050, spaced(10_050, 5))) == 101
