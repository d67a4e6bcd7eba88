"""What two clouds say of a pose: at the truth, at wrong ones, and in any unit, frame and order."""

import numpy as np
import pytest

from pipeline.kernels.geometry import apply, inverse, rigid, rotation_exp
from pipeline.registration.finding.evidence import Evidence, Judge
from pipeline.registration.finding.surface import Surface
from pipeline.types import PointCloud
from tests.pipeline.registration.finding.places import T_TRUE, pair, room, scan

EYES_M = (1.0, 1.2, 1.3), (2.0, 1.5, 1.1)


def slid(x_m: float, y_m: float = 0.0, z_m: float = 0.0) -> np.ndarray:
    return rigid(np.eye(3), [x_m, y_m, z_m])


def evidence(judged=(1000, 1000), on=1800, through=0) -> Evidence:
    return Evidence(judged, (2000, 4000), on, through, True, 1.0, 1.0, 0.1, "", float("nan"))


@pytest.fixture(scope="module")
def bare():
    """Two samplings of a whole room."""
    source, target = pair()
    return Judge(Surface(source), Surface(target))


@pytest.fixture(scope="module")
def views():
    """Two scans of a room from two places, and the pose of the second in the first."""
    first, second = (scan(eye_m, seed) for seed, eye_m in enumerate(EYES_M))
    return Judge(Surface(second), Surface(first)), slid(*np.subtract(EYES_M[1], EYES_M[0]))


def test_at_the_truth_all_is_on_the_surface_within_the_noise(bare):
    truth = bare(T_TRUE)
    assert truth.overlap_share > 0.98
    assert truth.on_share > 0.97
    assert 0.7 < truth.height_ratio < 1.2
    assert truth.through == 0
    assert truth.open_motions == ""
    assert np.isnan(truth.color_correlation)


@pytest.mark.parametrize("axis", range(3))
def test_slid_by_five_centimetres_less_is_on_the_surface(bare, axis):
    """A slide moves the faces across it off their partners, those along it stay."""
    truth, off = bare(T_TRUE), bare(slid(*0.05 * np.eye(3)[axis]) @ T_TRUE)
    assert off.on_share < truth.on_share - 0.1
    assert off.score < truth.score
    assert truth.clearly_better(off)
    assert not off.clearly_better(truth)


def test_a_slide_of_a_third_of_the_noise_changes_little_and_of_three_is_seen_in_the_heights(bare):
    """Heights add up in squares: sigma of both clouds is sqrt(2) x 3 mm, and one face in three moves."""
    truth = bare(T_TRUE).height_ratio
    assert bare(slid(0.001) @ T_TRUE).height_ratio == pytest.approx(truth, rel=0.05)
    assert bare(slid(0.009, 0.009, 0.009) @ T_TRUE).height_ratio > 1.5 * truth


def test_views_at_the_truth_see_no_point_in_free_space(views):
    judge, T_true = views
    truth = judge(T_true)
    assert judge.source.view is not None
    assert judge.target.view is not None
    assert truth.through_share < 0.002
    assert truth.on_share > 0.9
    assert truth.overlap_share > 0.8


@pytest.mark.parametrize("signs", [(-1.0, 1.0), (1.0, -1.0), (-1.0, -1.0)])
def test_given_normals_of_a_view_may_point_away_from_its_camera(views, signs):
    judge, T_true = views
    given = (
        Surface(PointCloud(one.points_m, normals=sign * one.normals))
        for one, sign in zip((judge.source, judge.target), signs, strict=True)
    )
    found, truth = Judge(*given)(T_true), judge(T_true)
    assert (found.judged, found.on, found.through) == (truth.judged, truth.on, truth.through)
    assert found.height_ratio == truth.height_ratio


def test_a_view_pulled_into_the_room_is_in_free_space(views):
    """Both ways: in one direction the near wall comes into the room, in the other the far one."""
    judge, T_true = views
    for away_m in (0.3, -0.3):
        assert judge(slid(away_m) @ T_true).through_share > 0.05


def test_what_is_behind_a_wall_is_hidden_and_not_refuted(views):
    """A scan three times as large is beyond all walls, one a third as large is in the air."""
    target = views[0].target
    behind = Surface(PointCloud(target.points_m * 3.0))
    there = target.judge(behind, np.eye(4))
    assert there.judged.mean() < 0.02
    assert not there.through.any()
    before = target.judge(Surface(PointCloud(target.points_m / 3.0)), np.eye(4))
    assert before.through.mean() > 0.95


def test_colours_correlate_where_they_are_the_same_and_not_where_they_are_shuffled():
    source, target = room(1), room(2)
    paint = np.array([[40.0, 10.0, 5.0], [0.0, 50.0, 20.0], [10.0, 0.0, 70.0]])

    def judge(*colors):
        clouds = (PointCloud(m, c.astype(np.uint8)) for m, c in zip((source, target), colors, strict=True))
        return Judge(*map(Surface, clouds))(np.eye(4)).color_correlation

    colors = [np.clip(points_m @ paint, 0, 255) for points_m in (source, target)]
    assert judge(*colors) > 0.99
    rng = np.random.default_rng(0)
    assert abs(judge(rng.permutation(colors[0]), colors[1])) < 0.1
    assert judge(255 - colors[0], colors[1]) < -0.95
    assert np.isnan(judge(np.full_like(colors[0], 90), np.full_like(colors[1], 90)))


@pytest.mark.parametrize("scale", [0.01, 100.0])
def test_evidence_knows_no_unit(bare, scale):
    source, target = (PointCloud(scale * cloud.points_m) for cloud in pair())
    judge, T = Judge(Surface(source), Surface(target)), slid(0.02) @ T_TRUE
    scaled = T.copy()
    scaled[:3, 3] *= scale
    one, other = bare(T), judge(scaled)
    assert one.judged == other.judged
    assert one.on == other.on
    assert other.height_ratio == pytest.approx(one.height_ratio, rel=1e-6)
    assert other.stiffness == pytest.approx(one.stiffness, rel=1e-6)


def test_bare_clouds_may_be_anywhere(bare):
    """Both clouds moved: the pose between them moves too, and the evidence stays."""
    moves = (
        rigid(rotation_exp(np.array([0.4, -1.0, 0.3])), [8.0, -3.0, 2.0]),
        rigid(rotation_exp(np.array([-0.2, 0.5, 2.0])), [-9.0, 7.0, 1.0]),
    )
    source, target = (PointCloud(apply(M, cloud.points_m)) for M, cloud in zip(moves, pair(), strict=True))
    T = slid(0.02) @ T_TRUE
    one, other = bare(T), Judge(Surface(source), Surface(target))(moves[1] @ T @ inverse(moves[0]))
    assert other.on_share == pytest.approx(one.on_share, abs=0.002)
    assert other.height_ratio == pytest.approx(one.height_ratio, rel=0.01)
    assert other.stiffness == pytest.approx(one.stiffness, rel=0.01)


def test_source_and_target_may_be_swapped(bare, views):
    for judge, T in ((bare, slid(0.02) @ T_TRUE), (views[0], slid(0.1) @ views[1])):
        one, other = judge(T), Judge(judge.target, judge.source)(inverse(T))
        assert one.judged == other.judged[::-1]
        assert (one.on, one.through) == (other.on, other.through)
        assert other.height_ratio == pytest.approx(one.height_ratio, rel=1e-9)


def test_a_similarity_is_judged_in_the_targets_unit():
    source, target = pair()
    judge = Judge(Surface(source), Surface(target))
    small = Judge(Surface(PointCloud(source.points_m / 3.0)), Surface(target))
    one, other = judge(T_TRUE), small(T_TRUE @ np.diag([3.0, 3.0, 3.0, 1.0]))
    assert other.on == pytest.approx(one.on, abs=3)
    assert other.height_ratio == pytest.approx(one.height_ratio, rel=1e-3)


def test_shares_are_of_the_judged_points():
    some = evidence((1000, 1000), on=1800, through=50)
    assert some.overlap_share == 0.5  # the larger one of 1000 / 2000 and 1000 / 4000
    assert some.on_share == 0.9
    assert some.against_share == pytest.approx(0.1)
    assert some.through_share == 0.025
    nothing = evidence((0, 0), on=0)
    assert (nothing.on_share, nothing.against_share, nothing.through_share) == (0.0, 1.0, 0.0)


def test_the_score_is_wilsons_bound():
    """40 observations of which 36 are good: (p + z^2/2n - z sqrt(p q/n + z^2/4n^2)) / (1 + z^2/n), z = 1."""
    p, n = 0.9, 40.0
    bound = (p + 0.5 / n - np.sqrt(p * (1 - p) / n + 0.25 / n**2)) / (1 + 1 / n)
    assert evidence().score == pytest.approx(bound, rel=1e-12)
    assert evidence((100, 100), on=180).score < evidence().score  # few points prove little
    assert evidence((100, 100), on=200).score < evidence((1000, 1000), on=1950).score


def test_clearly_better_is_half_of_what_speaks_against_the_other():
    assert evidence(on=1940).clearly_better(evidence(on=1860))  # 3 % against 7 %
    assert not evidence(on=1940).clearly_better(evidence(on=1870))  # against 6.5 %
    assert not evidence(on=2000).clearly_better(evidence(on=1991))


def test_two_rooms_back_to_back_see_their_wall_from_opposite_sides():
    source, target = (PointCloud(room(seed)) for seed in (1, 2))
    judge = Judge(Surface(source), Surface(target))
    assert judge(np.eye(4)).one_side_share > 0.95
    assert judge(slid(4.0)).one_side_share < 0.3
