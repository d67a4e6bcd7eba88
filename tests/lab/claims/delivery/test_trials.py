"""Trials: what is dropped, what is left of it, and that nothing lost costs nothing."""

from dataclasses import replace
from itertools import groupby

import numpy as np
import pytest

from lab.claims.delivery import trials
from lab.claims.delivery.setup import CODINGS, LARGE, LOSSLESS, SMALL, loss_tasks, lossless
from lab.claims.delivery.trials import (
    COUNT_OF_PIECES,
    LossTask,
    frames_left,
    loss_trial,
    packets_lost,
    piece_area,
    rebuilt,
)
from lab.claims.surface.clouds import single_node
from network_sim.config import LossConfig
from pipeline.io.demos import load_demo
from pipeline.kernels.geometry import scaled
from pipeline.reconstruct import reconstruct
from pipeline.types import DepthMap, Rig

EVERY = 8


@pytest.fixture(scope="module")
def rig():
    """One node of a demo, of whose pixels every eighth is left in each direction."""
    alone = single_node(load_demo("box-on-table"), 0)
    few = slice(None, None, EVERY)
    frame = alone.frames[0]
    small = replace(
        frame,
        rgb=np.ascontiguousarray(frame.rgb[few, few]),
        depth=DepthMap(np.ascontiguousarray(frame.depth.z_m[few, few])),
        intrinsics=scaled(frame.intrinsics, 1 / EVERY),
    )
    depth = DepthMap(np.ascontiguousarray(alone.truth.depth[0].z_m[few, few]))
    return Rig("small", (small,), replace(alone.truth, depth=(depth,), intrinsics=(small.intrinsics,)))


def scores(values):
    return {name: value for name, value in values.items() if name != "core_s"}


@pytest.mark.parametrize("share", [0.02, 0.1, 0.5])
@pytest.mark.parametrize("mean_burst", [1.0, 8.0])
def test_drops_have_the_share_and_the_bursts_that_were_asked_for(share, mean_burst):
    lost = packets_lost([200_000], LossConfig(share, mean_burst), seed=4)[0]
    runs = [len(list(run)) for gone, run in groupby(lost.tolist()) if gone]
    assert lost.mean() == pytest.approx(share, rel=0.1)
    assert np.mean(runs) == pytest.approx(mean_burst if mean_burst > 1.0 else 1.0 / (1.0 - share), rel=0.1)


def test_every_node_loses_packets_of_its_own_and_seeds_repeat():
    one, other = packets_lost([500, 500], LossConfig(0.2), seed=1)
    assert not np.array_equal(one, other)
    again = packets_lost([500, 500], LossConfig(0.2), seed=1)
    np.testing.assert_array_equal(np.stack([one, other]), np.stack(again))
    assert not np.array_equal(one, packets_lost([500, 500], LossConfig(0.2), seed=2)[0])


def test_rigs_with_equal_seeds_lose_different_packets(rig):
    one, other, again = (
        frames_left(rig, LossTask(name, "raw", SMALL, "burst", 0.3, 0))[0][0].rgb_known
        for name in ("one", "other", "one")
    )
    np.testing.assert_array_equal(one, again)
    assert not np.array_equal(one, other)


@pytest.mark.parametrize("coding", LOSSLESS)
@pytest.mark.parametrize("packet_bytes", [LARGE, SMALL])
def test_a_lossless_coding_without_losses_gives_the_very_images(rig, coding, packet_bytes):
    frames, traffic = frames_left(rig, LossTask("small", coding, packet_bytes, "burst", 0.0, 0))
    np.testing.assert_array_equal(frames[0].rgb, rig.frames[0].rgb)
    np.testing.assert_array_equal(frames[0].depth.z_m, rig.frames[0].depth.z_m)
    assert frames[0].coarse is None
    assert traffic["bytes_delivered"] == traffic["bytes_sent"]
    assert traffic["packets_lost"] == 0


def test_a_deadline_leaves_what_was_sent_first(rig):
    frames, traffic = frames_left(rig, LossTask("small", "raw", LARGE, "deadline", 0.5, 0))
    np.testing.assert_array_equal(frames[0].depth.z_m, rig.frames[0].depth.z_m)  # raw sends depth first
    known = frames[0].rgb_known
    assert 0.0 < known.mean() < 0.5
    assert not (np.diff(known.ravel().astype(int)) > 0).any()
    assert traffic["packets_lost"] == pytest.approx(0.5 * traffic["packets"], abs=len(rig.frames))


def test_without_losses_the_score_is_the_lossless_one_and_a_trial_repeats(rig, monkeypatch):
    monkeypatch.setattr(trials, "load_demo", lambda name: rig)
    result = reconstruct(rig)
    found = loss_trial(LossTask("small", "raw", LARGE, "random", 0.0, 0))
    assert found["f_before"] == result.truth_before["f_score_5cm"]
    assert found["f_after"] == result.truth_after["f_score_5cm"]
    assert found["no_hit_after"] == result.after.quality.no_hit_ray_share
    assert found["hole_area_m2_before"] == result.before.quality.hole_area_m2
    task = LossTask("small", "layered", SMALL, "burst", 0.25, 3)
    once, twice = loss_trial(task), loss_trial(task)
    assert scores(once) == scores(twice)
    assert 0 < once["packets_lost"] < once["packets"]
    assert once["no_hit_before"] > found["no_hit_before"]
    assert scores(loss_trial(replace(task, seed=4))) != scores(once)


def test_of_which_nothing_was_heard_there_is_no_surface(rig):
    deaf = replace(rig.frames[0], depth=DepthMap(np.full_like(rig.frames[0].depth.z_m, np.nan)))
    values = rebuilt(rig, [deaf])
    assert (values["heard"], values["f_after"], values["no_hit_after"]) == (0, 0.0, 1.0)
    assert values["median_depth_error_m_after"] is None


def test_the_pieces_of_an_image_are_all_of_it_once():
    covered = np.zeros((97, 130), int)
    for piece in range(COUNT_OF_PIECES):
        covered[piece_area(covered.shape, piece)] += 1
    assert (covered == 1).all()


def test_the_few_trials_are_some_of_all_of_them():
    few, everything = loss_tasks(), loss_tasks(full=True)
    assert len(few) == len(set(few)) < len(set(everything)) == len(everything)
    assert set(few) < set(everything)
    assert {lossless(task.rig, task.coding) for task in everything} <= set(few)
    assert {task.coding for task in few} == set(CODINGS)
