"""Matches of hand-made features: the ratio test, mutual neighbours, sizes and tags."""

import numpy as np

from pipeline.registration.colour import LiftedFeatures, match_score
from pipeline.registration.colour.matches import TAG_VOTES, matches


def _features(descriptors, sizes_m=None, tag_keys=()) -> LiftedFeatures:
    """Feature n is at (n, 0, 1), tag corner k at (k, 5, 1)."""
    count, tags = len(descriptors), len(tag_keys)
    return LiftedFeatures(
        "node",
        np.stack([np.arange(count), np.zeros(count), np.ones(count)], axis=1),
        np.full(count, 0.03),
        np.full(count, 0.1) if sizes_m is None else np.asarray(sizes_m),
        np.asarray(descriptors, np.uint8),
        np.stack([np.arange(tags), np.full(tags, 5.0), np.ones(tags)], axis=1),
        np.full(tags, 0.03),
        np.asarray(tag_keys, np.int64),
    )


def _looks(*entries: dict[int, int]) -> np.ndarray:
    """Descriptors that are 0 but for the given entries."""
    descriptors = np.zeros((len(entries), 128), np.uint8)
    for row, entry in enumerate(entries):
        for place, value in entry.items():
            descriptors[row, place] = value
    return descriptors


THREE = _looks({0: 200}, {40: 200}, {80: 200})


def test_each_feature_finds_the_one_that_looks_like_it():
    found = matches(_features(THREE), _features(THREE[[2, 0, 1]]))
    by_source = found.target_m[np.argsort(found.source_m[:, 0]), 0]
    np.testing.assert_array_equal(by_source, [1.0, 2.0, 0.0])
    np.testing.assert_allclose(found.sigma_m, np.hypot(0.03, 0.03))
    np.testing.assert_array_equal(found.votes, 1.0)


def test_a_feature_that_is_there_twice_is_not_matched():
    twice = np.concatenate([THREE, THREE[:1]])
    assert set(matches(_features(THREE), _features(twice)).source_m[:, 0]) == {1.0, 2.0}


def test_the_ratio_is_that_of_distances_of_rooted_descriptors():
    """Unit vectors of cosines c and d to the first: the ratio is sqrt((1 - c) / (1 - d)), and the limit 0.85.

    Shares a of entry 0 and 1 - a of another give a rooted descriptor with the cosine sqrt(a).
    """
    source = _looks({0: 200}, {80: 200})
    for share, matched in ((0.49, True), (0.56, False)):  # 0.2 over 0.3 and 0.252: ratios 0.82 and 0.89
        second = {0: round(100 * share), 2: round(100 * (1.0 - share))}
        found = matches(_features(source), _features(_looks({0: 64, 1: 36}, second, {80: 200})))
        assert (0.0 in found.source_m[:, 0]) == matched


def test_two_features_do_not_share_one():
    """Both are nearest to the same one, which is nearest to the second of them."""
    source = _looks({0: 100, 1: 100}, {0: 200}, {80: 200})
    found = matches(_features(source), _features(_looks({0: 200}, {40: 200}, {80: 200})))
    assert set(found.source_m[:, 0]) == {1.0, 2.0}


def test_features_of_another_size_are_others():
    sizes_m = np.array([0.1, 0.1, 0.2])
    found = matches(_features(THREE), _features(THREE, sizes_m))
    assert set(found.source_m[:, 0]) == {0.0, 1.0}


def test_equal_tag_corners_are_matched_in_all_ways():
    source, target = _features(THREE, tag_keys=[28, 29]), _features(THREE, tag_keys=[29, 28, 29])
    found = matches(source, target)
    at_tags = found.source_m[:, 1] == 5.0
    pairs = sorted(zip(found.source_m[at_tags, 0], found.target_m[at_tags, 0], strict=True))
    assert pairs == [(0.0, 1.0), (1.0, 0.0), (1.0, 2.0)]
    np.testing.assert_array_equal(found.votes[at_tags], TAG_VOTES)
    assert match_score(source, target) == 3.0 + 2.0 * TAG_VOTES
