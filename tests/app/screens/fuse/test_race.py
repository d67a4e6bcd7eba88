"""Races and their capture range as the computing process makes them."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from app.compute.state import Spec
from app.drawing.colors import MOST_DISTANCE_M
from app.screens.fuse.belief import Belief
from app.screens.fuse.capture_job import capture_job
from app.screens.fuse.draw import RaceDrawing
from app.screens.fuse.race_job import contest_of, race_job
from app.screens.fuse.view import CAPTURE_SHIFTS_M, CAPTURE_TURNS_DEG, Race, Start
from app.screens.scene.job import scene_job
from packetmesh.errors import InputError
from packetmesh.progress import drain as end
from pipeline.config import RegistrationConfig
from pipeline.io.rigs import save_rig
from pipeline.kernels.geometry import inverse, rigid
from pipeline.sources import Demo, RigFolder
from pipeline.types import PointCloud
from tests.app.screens.fuse.walks import walk

SPEC = Spec(Demo("box-on-table"))
SLIGHT = Race(start=Start.towards(3.0, 6.0, seed=0))
MAPPED = replace(SLIGHT, rivals=(("icp", "point"), ("ceicp-a", "plane")))


@pytest.fixture(scope="module")
def rig(store):
    return end(store.stage(SPEC, "rig"))


@pytest.fixture(scope="module")
def nodes(store):
    return end(store.stage(SPEC, "nodes"))


@pytest.fixture(scope="module")
def view(store):
    rivals = (("icp", "point"), ("ceicp-n", "plane"), ("ceicp-a", "plane"), ("icp", "plane"))
    return end(race_job(store, SPEC, replace(SLIGHT, rivals=rivals)))


def test_all_lanes_start_from_the_same_pose(view):
    assert [lane.label for lane in view.lanes] == ["ICP point", "CEICP-N plane", "CEICP-A plane", "ICP plane"]
    first = view.lanes[0].steps[0]
    for lane in view.lanes:
        np.testing.assert_array_equal(lane.steps[0].T_target_source, first.T_target_source)
        assert lane.steps[0].point_error_m == first.point_error_m


def test_all_lanes_have_one_place_in_the_scene(view, store, server):
    scene = end(scene_job(store, SPEC))
    RaceDrawing(server.scene, "/race", view, scene.stage)
    for index in range(4):
        frame = server.scene.get_handle_by_name(f"/race/lane{index}")
        np.testing.assert_allclose(frame.position, view.T_world_target[:3, 3])


def test_the_annealed_plane_version_arrives_and_plain_icp_does_not(view):
    errors_m = {lane.label: lane.steps[-1].point_error_m for lane in view.lanes}
    assert errors_m["CEICP-A plane"] < 0.005
    assert errors_m["ICP point"] > 0.05


def test_the_magnified_corner_shows_who_arrived(view):
    icp, ceicp = (view.lanes[index].steps[-1].lens[:, 2] for index in (0, 2))
    assert len(ceicp) > 100
    assert ceicp.max() < 30
    assert len(icp) == 0 or icp.min() > 60


def test_the_colours_are_those_of_the_error(view):
    for lane in view.lanes:
        for step in (lane.steps[0], lane.steps[-1]):
            shown_m = step.shades / 255.0 * MOST_DISTANCE_M
            capped_m = min(step.point_error_m, MOST_DISTANCE_M)
            assert np.sqrt(np.mean(shown_m**2)) == pytest.approx(capped_m, rel=0.35, abs=0.0005)


@pytest.fixture(scope="module")
def untrue(tmp_path_factory, rig):
    """The same scene, whose true poses nobody knows."""
    folder = tmp_path_factory.mktemp("untrue") / "rig"
    save_rig(folder, replace(rig, truth=None))
    return replace(SPEC, source=RigFolder(str(folder)))


def test_without_truth_the_number_is_the_distance_between_the_clouds(store, untrue):
    view = end(race_job(store, untrue, replace(SLIGHT, rivals=(("ceicp-a", "plane"),))))
    first, last = view.lanes[0].steps[0], view.lanes[0].steps[-1]
    assert view.reference == "cloud"
    assert first.point_error_m is None
    assert 0.0 < last.off_m < first.off_m
    assert last.shades.mean() < first.shades.mean()


def test_time_runs_forward_from_zero_and_ends_with_the_lane(view):
    for lane in view.lanes:
        times_s = np.array([step.time_s for step in lane.steps])
        assert times_s[0] == 0.0
        assert np.all(np.diff(times_s) > 0)
        assert times_s[-1] == lane.elapsed_s
        assert len(lane.steps) == lane.iterations + 1


def test_histograms_count_every_kept_pair_and_only_ceicp_has_the_kernel(view):
    for lane in view.lanes:
        assert lane.kernel == lane.label.startswith("CEICP")
        for step in lane.steps:
            shown = step.histogram
            assert len(shown.counts) == len(view.edges_m) - 1
            assert np.array_equal(shown.counts > 0, np.isfinite(shown.weights))
            assert np.nanmax(shown.weights) == pytest.approx(1.0)
            assert (shown.sigma_m > 0) == lane.kernel
    icp = view.lanes[0].steps[0].histogram
    assert np.allclose(icp.weights[icp.counts > 0], 1.0)


def test_the_weight_of_a_ceicp_pair_falls_with_its_distance(view):
    weights = view.lanes[1].steps[0].histogram.weights
    assert np.all(np.diff(weights[np.isfinite(weights)]) < 0)


def test_with_planes_the_weight_of_a_ceicp_a_pair_falls_with_the_angle_of_its_normals_too(view):
    shown = view.lanes[2].steps[0].histogram
    distances_m = 0.5 * (view.edges_m[1:] + view.edges_m[:-1])
    known = np.isfinite(shown.weights)
    alone = np.exp(-0.5 * (distances_m[known] / shown.sigma_m) ** 2)  # of equal normals, but for log p
    over = shown.weights[known] / alone
    assert np.std(over) > 0.05
    assert np.corrcoef(distances_m[known], shown.weights[known])[0, 1] < -0.9


@pytest.mark.parametrize("seed", range(4))
def test_a_start_is_as_far_off_as_it_says(rig, nodes, seed):
    contest = contest_of(rig, nodes, Race())
    start = Start.towards(20.0, 40.0, seed)
    motion = contest.start_pose(start) @ np.linalg.inv(contest.T_aligned)
    turn_deg = np.degrees(np.arccos((np.trace(motion[:3, :3]) - 1) / 2))
    moved_m = motion[:3, :3] @ contest.center_m + motion[:3, 3] - contest.center_m
    assert turn_deg == pytest.approx(20.0, abs=0.02)
    assert 100 * np.linalg.norm(moved_m) == pytest.approx(40.0, abs=0.02)


def test_aligned_is_the_truth(rig, nodes):
    contest = contest_of(rig, nodes, Race())
    assert contest.error_m(contest.start_pose(Start())) == 0.0


def test_two_keyframes_are_compared_with_their_poses_by_the_whole_walk(rig, nodes):
    contest = contest_of(replace(rig, truth=None, walk=walk()), nodes, Race())
    poses = [frame.T_world_camera for frame in rig.frames]
    np.testing.assert_array_equal(contest.T_home, inverse(poses[0]) @ poses[1])
    assert contest.reference == "walk"
    assert contest.error_m(contest.start_pose(Start())) == pytest.approx(0.0, abs=1e-9)


def test_degrading_changes_the_source_only(rig, nodes):
    plain, worse = (
        contest_of(rig, nodes, race)
        for race in (Race(), Race(noise_m=0.03, hole_share=0.4, outlier_share=0.1))
    )
    np.testing.assert_array_equal(worse.target.points_m, plain.target.points_m)
    np.testing.assert_array_equal(worse.T_aligned, plain.T_aligned)
    np.testing.assert_array_equal(worse.start_pose(SLIGHT.start), plain.start_pose(SLIGHT.start))
    np.testing.assert_array_equal(worse.error_points_m, plain.error_points_m)
    assert len(worse.source) == pytest.approx(0.6 * len(plain.source), rel=0.05)
    assert plain.source is nodes[1].sensor


def test_an_inferred_cloud_belongs_where_it_is(rig, nodes):
    contest = contest_of(rig, nodes, Race(mode="inferred", source=2, target=2))
    np.testing.assert_array_equal(contest.T_home, np.eye(4))
    assert contest.reference == "pixels"
    assert contest.source is nodes[2].inferred
    assert contest.target is nodes[2].sensor


@pytest.mark.parametrize("which", ["source", "target"])
def test_a_node_that_an_address_names_has_to_be_there(rig, nodes, which):
    with pytest.raises(InputError, match=f"no node number 99, only 0 to {len(nodes) - 1}"):
        contest_of(rig, nodes, Race(**{which: 99}))


@pytest.mark.parametrize(
    ("race", "from_cameras"),
    [
        (Race(), (True, True)),
        (Race(noise_m=0.01), (False, True)),
        (Race(mode="inferred"), (False, True)),
        (Race(mode="corridor"), (False, False)),
    ],
)
def test_a_cloud_shows_free_space_if_it_is_a_cameras_own_and_not_degraded(rig, nodes, race, from_cameras):
    assert contest_of(rig, nodes, race).from_cameras == from_cameras


def test_a_camera_that_looks_through_a_fence_knows_the_free_space_between_its_bars():
    """Half a metre nearer than it was seen, the wall behind the fence is where the camera saw through."""
    columns, rows = (part.ravel() for part in np.meshgrid(np.arange(240), np.arange(180)))
    z_m = np.where(columns % 24 < 8, 1.0, 2.0)
    seen_m = np.column_stack([(columns - 120) / 200.0 * z_m, (rows - 90) / 200.0 * z_m, z_m])
    fence = PointCloud(seen_m)
    nearer = rigid(np.eye(3), np.array([0.0, 0.0, -0.5]))
    known, unknown = (
        Belief(fence, fence, RegistrationConfig(), from_cameras)._judge(nearer)
        for from_cameras in ((True, True), (False, False))
    )
    assert known.through > 1000
    assert (unknown.refutable, unknown.through) == (False, 0)


def test_a_node_is_not_moved_onto_itself(rig, nodes):
    with pytest.raises(InputError, match="cannot be moved onto itself"):
        contest_of(rig, nodes, Race(source=1, target=1))


def test_a_method_that_finds_no_pair_stays_at_its_start(store):
    view = end(race_job(store, SPEC, replace(SLIGHT, start=Start((0.0, 0.0, 0.0), (0.0, 0.0, 5000.0)))))
    lost = view.lanes[1]
    assert lost.stop_reason.startswith("No pair of points is within the gate")
    assert len(lost.steps) == 1
    assert lost.iterations == 0


@pytest.fixture(scope="module")
def capture(store):
    return end(capture_job(store, SPEC, MAPPED))


def test_the_capture_range_has_a_cell_for_every_start_and_tells_methods_apart(capture):
    assert capture.labels == ("ICP point", "CEICP-A plane")
    assert capture.errors_m.shape == (2, len(CAPTURE_TURNS_DEG), len(CAPTURE_SHIFTS_M))
    assert np.isfinite(capture.errors_m).all()
    reached = (capture.errors_m < 0.02).sum(axis=(1, 2))
    assert reached[1] > reached[0]


def test_the_capture_range_is_the_same_again_and_from_any_start(capture, store):
    """Of the same clouds, computed anew."""
    forgetful = SimpleNamespace(stages=store.stages, remember=lambda key, compute: compute())
    again = end(capture_job(forgetful, SPEC, replace(MAPPED, start=Start())))
    np.testing.assert_array_equal(again.errors_m, capture.errors_m)


def test_without_truth_there_is_no_capture_range(store, untrue):
    with pytest.raises(InputError, match="true poses of this scene are not known"):
        end(capture_job(store, untrue, Race()))
