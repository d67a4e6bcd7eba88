"""The search finds a place from near and far, and is not sure where it cannot be."""

from dataclasses import replace

import numpy as np
import pytest

from packetmesh.errors import ReconstructionError
from pipeline.config import RegistrationConfig
from pipeline.kernels.geometry import apply, inverse, rigid, rotation_exp
from pipeline.registration import point_error_m
from pipeline.registration.finding import doubts
from pipeline.registration.finding.candidates import Candidate
from pipeline.registration.finding.doubts import Checks
from pipeline.registration.finding.evidence import Judge
from pipeline.registration.finding.poses import compared_points_m, same, turn_deg
from pipeline.registration.finding.rivals import better_slide
from pipeline.registration.finding.search import search
from pipeline.registration.finding.starts import Start, by_surfaces, default_gates_m
from pipeline.registration.finding.surface import Surface
from pipeline.registration.finding.verdict import verdict_on
from pipeline.registration.global_start import default_voxel_m
from pipeline.types import PointCloud
from tests.pipeline.registration.finding.places import T_TRUE, pair, room

CONFIG = RegistrationConfig()
COUNT = 2500


def found_from(source: PointCloud, target: PointCloud, T_start=None, seed: int = 0):
    """The search's answer from the identity or another given start."""
    start = Start("given", lambda: [np.eye(4) if T_start is None else T_start])
    judge = Judge(Surface(source), Surface(target))
    return search(source, target, [start], judge, replace(CONFIG, seed=seed))


@pytest.fixture(scope="module")
def clouds():
    return pair(0, COUNT)


@pytest.fixture(scope="module")
def answer(clouds):
    return found_from(*clouds)


def error_m(found, source, T_true=T_TRUE) -> float:
    return point_error_m(found.candidate.T_target_source, T_true, source.points_m)


def test_a_near_start_leads_to_a_sure_answer(clouds, answer):
    assert answer.verdict.text == "sure"
    assert answer.way == "given"
    assert error_m(answer, clouds[0]) < 0.01
    assert answer.spread_m < 0.01
    assert answer.candidate in answer.tried


def test_the_search_is_deterministic(clouds, answer):
    again = found_from(*clouds)
    np.testing.assert_array_equal(again.candidate.T_target_source, answer.candidate.T_target_source)
    assert again.verdict == answer.verdict
    assert again.spread_m == answer.spread_m


def test_source_and_target_swapped_end_in_the_inverse(clouds, answer):
    back = found_from(*clouds[::-1])
    assert back.verdict == answer.verdict
    assert error_m(back, clouds[1], inverse(T_TRUE)) < 0.01


def test_the_unit_of_length_does_not_matter(clouds, answer):
    scaled = found_from(*(PointCloud(100.0 * cloud.points_m) for cloud in clouds))
    assert scaled.verdict == answer.verdict
    assert scaled.candidate.gate_m == pytest.approx(100.0 * answer.candidate.gate_m)
    assert scaled.candidate.evidence.on_share == pytest.approx(answer.candidate.evidence.on_share, abs=1e-3)
    assert scaled.spread_m == pytest.approx(100.0 * answer.spread_m, rel=1e-3)


def test_bare_clouds_may_be_moved_together(clouds, answer):
    move = rigid(rotation_exp(np.array([0.4, -1.0, 0.3])), [8.0, -3.0, 2.0])
    moved = [PointCloud(apply(move, cloud.points_m)) for cloud in clouds]
    found = found_from(*moved)
    assert found.verdict == answer.verdict
    assert error_m(found, moved[0], move @ T_TRUE @ inverse(move)) < 0.01


def test_from_across_the_room_features_lead_to_the_place(clouds):
    source, target = clouds
    far = rigid(rotation_exp(np.array([0.3, 0.2, 1.9])), [9.0, -4.0, 1.0])
    moved = PointCloud(apply(inverse(far), source.points_m))
    starts = [Start("given", lambda: [np.eye(4)]), by_surfaces(moved, target)]
    found = search(moved, target, starts, Judge(Surface(moved), Surface(target)), CONFIG)
    assert found.way == "surfaces"
    assert found.verdict.text == "sure"
    assert error_m(found, moved, T_TRUE @ far) < 0.01


def comb(seed: int, end: int = 6000) -> PointCloud:
    """A wall of 3 x 1 m with grooves 7 cm wide and 8 cm deep, one every 15 cm, and an open box at its end.

    ``end`` is the number of points of the wall at its end.
    """
    rng = np.random.default_rng(seed)
    x_m, y_m = rng.uniform(0.0, 3.0, 12_000), rng.uniform(0.0, 1.0, 12_000)
    wall_m = np.stack([x_m, y_m, np.where(x_m % 0.15 < 0.07, 0.08, 0.0)], axis=1)
    end_m = np.stack([np.full(end, 3.0), *rng.uniform(-0.6, [[1.0], [0.6]], (2, end))], axis=1)
    floor_m = np.stack([*rng.uniform(0.0, [[3.0], [0.6]], (2, 6000)), np.zeros(6000)], axis=1)[:, [0, 2, 1]]
    points_m = np.concatenate([wall_m, end_m, floor_m])
    return PointCloud(points_m + rng.normal(0.0, 0.001, points_m.shape))


def colored_along_y(cloud: PointCloud) -> PointCloud:
    """The cloud in greys that do not change along a wall."""
    greys = np.clip(127.0 + 200.0 * (cloud.points_m[:, 1:2] - 0.4), 0, 255)
    return replace(cloud, colors=np.tile(greys, 3).astype(np.uint8))


@pytest.mark.parametrize("end", [300, 60])
@pytest.mark.parametrize("colored", [True, False])
def test_a_groove_farther_is_left_though_both_sides_of_it_lead_back(end, colored):
    """The surfaces hardly hold the pose along the wall, and half a groove away they pull to the wrong one."""
    source, target = (colored_along_y(comb(seed, end)) if colored else comb(seed, end) for seed in (0, 1))
    found = found_from(source, target, rigid(np.eye(3), [-0.15, 0.0, 0.0]))
    right = point_error_m(found.candidate.T_target_source, np.eye(4), source.points_m) < 0.01
    assert right or found.verdict.word != "sure"


def test_one_groove_farther_along_a_slide_leads_back():
    source, target = comb(0), comb(1)
    judge, T_wrong = Judge(Surface(source), Surface(target)), rigid(np.eye(3), [-0.15, 0.0, 0.0])
    evidence = judge(T_wrong)
    assert evidence.on_share > 0.75
    held = replace(evidence, stiffness=0.02)
    assert better_slide(source, target, T_wrong, held, judge, CONFIG) is None  # nothing in free space
    seen_through = replace(held, through=sum(evidence.judged) // 50)
    better = better_slide(source, target, T_wrong, seen_through, judge, CONFIG)
    assert point_error_m(better.T_target_source, np.eye(4), source.points_m) < 0.01
    assert better.evidence.score > evidence.score


def test_where_few_points_lead_apart_more_points_decide(monkeypatch, clouds, answer):
    """An answer 5 cm from where the draws of its points lead is registered again, with more of them."""
    source, target = clouds
    checks = Checks(source, target, Judge(Surface(source), Surface(target)), CONFIG)
    monkeypatch.setattr(doubts, "QUICK_POINTS", 500)
    monkeypatch.setattr(doubts, "MORE_POINTS", (2000,))
    rough = Candidate(
        np.eye(4), rigid(np.eye(3), [0.05, 0.0, 0.0]) @ T_TRUE, 0.3, "p2q", answer.candidate.evidence
    )
    doubtful = checks("given", rough, [rough])
    assert not doubtful.settled
    assert doubtful.spread_m == pytest.approx(0.05, abs=0.01)
    assert doubtful.undecided
    checked = checks.complete("given", rough, doubtful.spread_m, [rough])
    assert checked.settled
    assert checked.spread_m < 0.01
    assert point_error_m(checked.candidate.T_target_source, T_TRUE, source.points_m) < 0.01


@pytest.mark.parametrize(
    ("few_m", "more_m", "word", "repetitions"),
    [(1.0, 0.001, "sure", [1]), (1.0, 1.0, "doubtful", [2]), (0.03, 1.0, "doubtful", [2, 2])],
)
def test_of_answers_whose_few_points_disagree_only_the_best_is_repeated_with_more(
    monkeypatch, clouds, few_m, more_m, word, repetitions
):
    """With so many points a registration takes a second, and each gate of each start has an answer. Where few
    points agree within half a fiftieth of the extent, each is repeated, and none again in the end."""
    few, repeated = doubts.QUICK_POINTS, []

    def spread_m(checks, answer, points=few):
        return few_m if points == few else more_m

    def again(checks, answer, seed, points):
        repeated.append(points)
        return answer.T_target_source

    source, target = clouds
    judge, start = Judge(Surface(source), Surface(target)), Start("given", lambda: [np.eye(4)])
    voxel_m = default_voxel_m(target)
    assert 0.3 * voxel_m < 0.03 < 0.5 * voxel_m
    monkeypatch.setattr(Checks, "_spread_m", spread_m)
    monkeypatch.setattr(Checks, "_again", again)
    monkeypatch.setattr(doubts, "QUICK_POINTS", 500)
    monkeypatch.setattr(doubts, "MORE_POINTS", (1000, 1500))
    found = search(source, target, [start], judge, CONFIG, gates_m=(0.3, 0.6))
    assert len(found.tried) == 2
    assert repeated == [points for count in repetitions for points in (1000, 1500)[:count]]
    assert (found.verdict.word, found.settled) == (word, word == "sure")
    assert found.spread_m == more_m
    assert error_m(found, source) < 0.01


def test_a_complete_check_knows_an_answer_elsewhere_with_a_better_score(clouds, answer):
    source, target = clouds
    checks, here = Checks(source, target, Judge(Surface(source), Surface(target)), CONFIG), answer.candidate
    T_other = rigid(np.eye(3), [1.0, 0.0, 0.0]) @ here.T_target_source
    better = replace(here, T_target_source=T_other, evidence=replace(here.evidence, on=here.evidence.on + 1))
    checked = checks.complete("given", here, 0.1, [here, better])
    assert checked.doubts == ("1 m away, the source fits as well",)
    assert not checked.settled
    assert not checked.undecided


def test_more_points_replace_no_answer_whose_evidence_was_better(monkeypatch, clouds, answer):
    """A judge that sees through what it is asked again leaves the answer and its spread as they were."""
    source, target = clouds
    found, judge = answer.candidate, Judge(Surface(source), Surface(target))

    class Stern(Judge):
        def __call__(self, T_target_source):
            return replace(found.evidence, through=sum(found.evidence.judged))

    monkeypatch.setattr(doubts, "CLOSE_VOXELS", 0.0)
    monkeypatch.setattr(doubts, "QUICK_POINTS", 500)
    monkeypatch.setattr(doubts, "MORE_POINTS", (1000,))
    kept = Checks(source, target, Stern(judge.source, judge.target), CONFIG)("given", found, [found])
    np.testing.assert_array_equal(kept.candidate.T_target_source, found.T_target_source)
    assert 0.0 < kept.spread_m < 0.03
    again = Checks(source, target, judge, CONFIG)("given", found, [found])
    assert point_error_m(again.candidate.T_target_source, found.T_target_source, source.points_m) > 0.0


@pytest.mark.parametrize("part", ["source", "target"])
def test_a_part_finds_its_place_in_the_whole(part):
    source, target = pair(0, 2 * COUNT)
    if part == "source":
        source = source.select(np.flatnonzero(apply(T_TRUE, source.points_m)[:, 0] < 3.0))
    else:
        target = target.select(np.flatnonzero(target.points_m[:, 0] < 3.0))
    found = found_from(source, target)
    assert found.verdict.text == "sure"
    assert found.candidate.evidence.overlap_share > 0.95
    assert error_m(found, source) < 0.01


def test_a_cloud_stays_on_itself(clouds):
    found = found_from(clouds[1], clouds[1])
    assert found.verdict.text == "sure"
    np.testing.assert_allclose(found.candidate.T_target_source, np.eye(4), atol=1e-6)
    assert found.candidate.evidence.on_share == 1.0
    assert found.spread_m < 1e-6


def test_two_different_rooms_are_not_called_one():
    other = room(5, COUNT, (5.2, 2.1, 3.4))[:, [1, 0, 2]] * [1.0, -1.0, 1.0]
    assert not found_from(PointCloud(other), PointCloud(room(2, COUNT))).verdict.sure


@pytest.mark.parametrize("size_m", [(3.0, 3.0, 2.4), (3.0, 3.0, 3.0)])
def test_an_empty_square_room_fits_after_a_quarter_turn(size_m):
    def box(seed: int) -> np.ndarray:
        rng = np.random.default_rng(seed)
        points = rng.uniform(0.0, 1.0, (COUNT, 3))
        points[np.arange(COUNT), rng.integers(0, 3, COUNT)] = rng.integers(0, 2, COUNT)
        return points * size_m + rng.normal(scale=0.003, size=(COUNT, 3))

    found = found_from(PointCloud(apply(inverse(T_TRUE), box(1))), PointCloud(box(2)))
    assert found.verdict.word == "doubtful"
    assert "degrees, the source fits as well" in found.verdict.text


def surface(name: str, seed: int) -> np.ndarray:
    """A plane, a corridor along x or a sphere, with noise."""
    rng = np.random.default_rng(seed)
    a, b = rng.uniform(0.0, 1.0, (2, COUNT))
    rays = rng.normal(size=(COUNT, 3))
    zero, side = np.zeros(COUNT), rng.integers(0, 4, COUNT)
    points = {
        "plane": np.stack([2 * a, 2 * b, zero], axis=1),
        "corridor": np.stack(
            [
                3 * a,
                np.choose(side, [2 * b, 2 * b, zero, 2 + zero]),
                np.choose(side, [zero, 2 + zero, 2 * b, 2 * b]),
            ],
            axis=1,
        ),
        "sphere": rays / np.linalg.norm(rays, axis=1, keepdims=True),
    }[name]
    return points + rng.normal(scale=0.003, size=(COUNT, 3))


@pytest.mark.parametrize(
    ("name", "says"),
    [
        ("plane", "sliding in any direction perpendicular to z and turning about z"),
        ("corridor", ""),
        ("sphere", "turning about any axis"),
    ],
)
def test_a_shape_with_an_open_motion_is_never_sure(name, says):
    """A corridor's rim holds it a little, which the stiffness says."""
    source, target = (Surface(PointCloud(surface(name, seed))) for seed in (1, 2))
    verdict = verdict_on(Judge(source, target)(np.eye(4)))
    assert verdict.word == "doubtful"
    assert says in verdict.text


def test_only_a_pose_to_which_both_sides_come_back_is_settled_with_little_stiffness(
    monkeypatch, clouds, answer
):
    """In a corridor a registration that begins a little farther along stays there."""
    monkeypatch.setattr(doubts, "DRAWS", 0)
    source, target = (PointCloud(surface("corridor", seed)) for seed in (1, 2))
    judge = Judge(Surface(source), Surface(target))
    T_wrong = rigid(np.eye(3), [0.3, 0.0, 0.0])
    along = Candidate(T_wrong, T_wrong, 0.2, "p2q", judge(T_wrong))
    assert along.evidence.stiffness < doubts.LITTLE_STIFFNESS
    assert not along.evidence.open_motions
    checked = Checks(source, target, judge, CONFIG)("given", along, [along])
    assert not checked.settled
    assert "registered again" in checked.doubts[-1]
    found = answer.candidate
    loose = replace(found, evidence=replace(found.evidence, stiffness=along.evidence.stiffness))
    held = Checks(*clouds, Judge(*map(Surface, clouds)), CONFIG)("given", loose, [loose])
    assert held.settled
    assert 0.0 < held.spread_m < 0.01


def test_clouds_far_apart_have_no_start(clouds):
    with pytest.raises(ReconstructionError, match="No start pose leads to a registration"):
        found_from(PointCloud(clouds[0].points_m + 500.0), clouds[1])


@pytest.mark.parametrize("size", [0.01, 100.0])
@pytest.mark.parametrize("way", ["given", "surfaces"])
def test_gates_ascend_and_grow_with_the_place(clouds, way, size):
    gates_m = default_gates_m(clouds[1], way)
    assert gates_m == sorted(set(gates_m))
    scaled = default_gates_m(PointCloud(size * clouds[1].points_m), way)
    np.testing.assert_allclose(scaled, np.multiply(size, gates_m), rtol=1e-9)


def test_strays_do_not_decide_whether_two_poses_are_the_same():
    """At a kilometre, a thousandth of a degree is 2 cm."""
    points_m = room(1, 1000)
    points_m[::10] += 1000.0
    cloud = PointCloud(points_m)
    assert len(compared_points_m(cloud)) == 900
    assert len(compared_points_m(PointCloud(room(1, 1000)))) == 1000
    little = rigid(rotation_exp(np.array([0.0, 0.0, 1e-3])), np.zeros(3))
    assert same(np.eye(4), little, cloud, PointCloud(room(2, 1000)))
    assert not same(np.eye(4), rigid(np.eye(3), [0.1, 0.0, 0.0]), cloud, PointCloud(room(2, 1000)))


@pytest.mark.parametrize("scale", [0.3, 1.0, 40.0])
def test_the_angle_between_poses_does_not_know_their_scale(scale):
    turned = rigid(scale * rotation_exp(np.array([0.0, 0.5, 0.0])), [1.0, 2.0, 3.0])
    assert turn_deg(turned, rigid(scale * np.eye(3), np.zeros(3))) == pytest.approx(np.degrees(0.5))
