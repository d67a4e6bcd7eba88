"""Numbers of a recording's path."""

import numpy as np
import pytest

from pipeline.folders.walk import lost_sentences, walk_metrics
from pipeline.types import PointCloud, Walk


@pytest.mark.parametrize(("resumed_s", "frames_per_s"), [(0.0, 20.0), (30.0, 5.0)])
def test_the_time_of_interrupted_runs_counts_for_the_frames_a_second(resumed_s, frames_per_s):
    poses = (np.eye(4),) * 200
    nothing = PointCloud(np.zeros((0, 3))), 0.01, np.zeros(0, int)
    walk = Walk(np.arange(200) / 30.0, poses, (0,), (), *nothing, poses, (), resumed_s)
    assert walk_metrics(walk, 10.0)["frames_per_s"] == frames_per_s


def walk_of(lost=(), **causes):
    """A recording of ten frames, of which some have no pose."""
    poses = tuple(None if k in lost else np.eye(4) for k in range(10))
    nothing = PointCloud(np.zeros((0, 3))), 0.01, np.zeros(0, int)
    return Walk(np.arange(10) / 30.0, poses, (0,), (), *nothing, poses, **causes)


def test_each_cause_of_a_loss_has_a_sentence_of_its_own():
    walk = walk_of(lost=(1, 2, 4, 6, 7, 8), without_depth=(1, 2), apart=(6, 7, 8))
    metrics = walk_metrics(walk, 1.0)
    assert metrics["lost"] == [(1, 2), (4, 4), (6, 8)]
    depth, apart, lost = lost_sentences(metrics)
    assert depth.startswith("2 of 10 frames (1 to 2) have no depth")
    assert apart.startswith("3 of 10 frames (6 to 8) have no connection")
    assert "record a way between" in apart
    assert lost.startswith("The camera was lost in 1 of 10 frames (4), which")
    assert [("slowly" in one) for one in (depth, apart, lost)] == [False, False, True]


def test_a_single_cause_is_the_only_sentence():
    (sentence,) = lost_sentences(walk_metrics(walk_of(lost=(3,), without_depth=(3,)), 1.0))
    assert sentence.startswith("1 of 10 frames (3) has no depth")
    assert lost_sentences(walk_metrics(walk_of(), 1.0)) == []


def test_what_moved_is_said_if_it_is_in_more_than_two_frames():
    assert lost_sentences(walk_metrics(walk_of(disturbed=(4, 5)), 1.0)) == []
    (sentence,) = lost_sentences(walk_metrics(walk_of(disturbed=(4, 5, 7)), 1.0))
    assert sentence.startswith("In 3 of 10 frames")
    assert "something moved" in sentence


def test_keyframes_that_agree_little_show_that_something_moved():
    metrics = walk_metrics(walk_of(), 1.0)
    assert [lost_sentences(metrics, share) for share in (0.97, float("nan"))] == [[], []]
    (sentence,) = lost_sentences(metrics, 0.875)
    assert sentence.startswith("Of what two keyframes measured only 87.5% agrees")
    assert "probably something moved" in sentence
