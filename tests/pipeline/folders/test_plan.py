"""Sentences of a plan's folder."""

from types import SimpleNamespace

import pytest

from pipeline.folders.plan import level_sentence


@pytest.mark.parametrize(
    ("known", "says"), [((False,), True), ((False, False), True), ((False, True), False)]
)
def test_an_assumed_upward_direction_is_said(known, says):
    frames = tuple(SimpleNamespace(pose_known=one) for one in known)
    sentence = level_sentence(SimpleNamespace(rig=SimpleNamespace(frames=frames)))
    assert bool(sentence) is says
    assert ("counts as level" in sentence) is says
