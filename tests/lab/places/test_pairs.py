"""Rendered pairs: the truth brings the views together, splits share no room, and the cache keeps the bits."""

import numpy as np
import pytest

from lab.places import pairs
from lab.places.cuts import NOISE_M, POINTS, cut_pair
from lab.places.pairs import (
    CLASSES,
    HELD_OUT,
    VALIDATION,
    bench_pairs,
    mixed_pairs,
    pair,
    rooms_of,
)
from packetmesh.errors import InputError
from pipeline.kernels.geometry import apply, rotation_angle_rad
from pipeline.kernels.kdtree import tree_of

SURE_OVERLAP = 0.6


def distances_m(source, target, T):
    """Distances of moved source points to the nearest target points."""
    return tree_of(target.points_m).nearest(apply(T, source.points_m), 1)[0][:, 0]


@pytest.fixture(scope="module")
def views(tmp_path_factory):
    folder = tmp_path_factory.mktemp("places")
    return folder, pair(HELD_OUT, 0, SURE_OVERLAP, folder)


def test_the_overlap_is_the_wanted_one_and_the_truth_brings_that_share_together(views):
    _, made = views
    assert made.overlap_share == pytest.approx(SURE_OVERLAP, abs=0.02)
    source, target = made.clouds
    near = np.mean(distances_m(source, target, made.T_target_source) < 0.02)
    assert near > 0.9 * SURE_OVERLAP
    assert np.mean(distances_m(source, target, np.linalg.inv(made.T_target_source)) < 0.02) < 0.6 * near


def test_no_frame_tells_its_pose(views):
    _, made = views
    assert not made.source.pose_known
    assert not made.target.pose_known
    assert np.array_equal(made.source.T_world_camera, made.target.T_world_camera)


def test_a_pair_from_the_cache_is_the_rendered_one_and_a_damaged_file_is_rendered_again(views):
    folder, made = views
    (path,) = folder.rglob("*.npz")
    again = pair(HELD_OUT, 0, SURE_OVERLAP, folder)
    for one, other in ((made.source, again.source), (made.target, again.target)):
        assert np.array_equal(one.rgb, other.rgb)
        assert np.array_equal(one.depth.z_m, other.depth.z_m, equal_nan=True)
    assert np.array_equal(made.T_target_source, again.T_target_source)
    assert (again.overlap_share, again.room) == (made.overlap_share, made.room)
    contents = path.read_bytes()
    path.write_bytes(contents[: len(contents) // 2])
    assert np.array_equal(pair(HELD_OUT, 0, SURE_OVERLAP, folder).source.rgb, made.source.rgb)


def test_views_of_different_rooms_have_no_pose(tmp_path):
    for _ in range(2):  # rendered, then read
        made = pair(VALIDATION, 3, None, tmp_path)
        assert made.T_target_source is None
        assert made.overlap_share == 0.0


def test_no_room_is_in_two_splits_or_two_pairs():
    used = [
        seed + away
        for split in (VALIDATION, HELD_OUT)
        for index in (0, 1, 999, 1000, pairs.NEXT_ROOM - 1)
        for seed, _ in rooms_of(split, index)
        for away in (0, pairs.OTHER_ROOM)
    ]
    assert len(set(used)) == len(used)
    lasts = [
        max(seed for seed, _ in rooms_of(split, pairs.NEXT_ROOM - 1)) for split in (VALIDATION, HELD_OUT)
    ]
    assert lasts[0] < pairs.FIRST_ROOM[HELD_OUT]
    assert lasts[1] < pairs.FIRST_ROOM[VALIDATION] + pairs.OTHER_ROOM


def test_the_benchmark_has_equally_many_pairs_of_each_overlap():
    found = list(bench_pairs(5))
    assert [index for index, _ in found] == list(range(20))
    assert all([overlap for _, overlap in found].count(one) == 5 for one in CLASSES)


def test_mixed_pairs_are_a_tenth_of_other_rooms_a_tenth_apart_and_even_from_0_to_90_percent():
    overlaps = [overlap for _, overlap in mixed_pairs(HELD_OUT, 2000)]
    some = [overlap for overlap in overlaps if overlap]
    assert overlaps.count(None) == pytest.approx(200, abs=45)  # three deviations
    assert overlaps.count(0.0) == pytest.approx(200, abs=45)
    assert np.allclose(np.histogram(some, 3, (0.0, 0.9))[0], len(some) / 3, atol=60)
    assert {index for index, _ in mixed_pairs(HELD_OUT, 50)}.isdisjoint(index for index, _ in bench_pairs(75))


@pytest.mark.parametrize(("index", "overlap"), [(-1, 0.5), (20_000, 0.5), (0, 0.95), (0, -0.1)])
def test_what_cannot_be_is_one_sentence(index, overlap):
    with pytest.raises(InputError, match="0 to"):
        pair(VALIDATION, index, overlap, None)


@pytest.mark.parametrize("overlap", [0.6, 0.15])
def test_a_cut_pair_starts_off_by_what_was_wanted_and_shares_the_wanted_part(overlap):
    made = cut_pair(VALIDATION, 1, overlap, start_deg=16.0, start_m=0.28)
    assert len(made.source) == len(made.target) == POINTS
    T = made.T_target_source
    assert np.degrees(rotation_angle_rad(T[:3, :3])) == pytest.approx(16.0)
    middle_m = made.source.points_m.mean(axis=0)
    assert np.linalg.norm(apply(T, middle_m[None])[0] - middle_m) == pytest.approx(0.28)
    spacing_m = np.median(tree_of(made.target.points_m).nearest(made.target.points_m, 2)[0][:, 1])
    shared, at_start = (
        np.mean(distances_m(made.source, made.target, pose) < 2.0 * (spacing_m + NOISE_M))
        for pose in (T, np.eye(4))
    )
    assert shared == pytest.approx(overlap, abs=0.06)
    assert at_start < 0.8 * shared
