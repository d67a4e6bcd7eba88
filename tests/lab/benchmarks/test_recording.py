"""Walks: every program answers on one, and trajectories, maps and summaries are judged as they should be."""

import shutil
from concurrent.futures.process import BrokenProcessPool
from types import SimpleNamespace

import numpy as np
import pytest

from lab.benchmarks import recording
from lab.benchmarks.recording import compared, summary
from lab.trials import trial_digest
from lab.walks import peers
from lab.walks.held_out import FIRST_ROOM, WalkTask, frames_in_memory, held_out_walks
from lab.walks.judging import map_errors, rpe_m, to_truth, trajectory_errors
from lab.walks.ours import OURS, OURS_TRACKING, OWN, solve_own
from lab.walks.path import NoWalkError
from lab.walks.peers import available_walk_peers, solve_peer
from lab.walks.surfaces import BESIDE_M, Mesh, surface_errors
from lab.walks.walk import TRUE_POSES, TRUTH, WalkTruth, kinect, read_truth
from packetmesh.errors import InputError
from pipeline.kernels.geometry import apply, inverse, look_at, rigid, rotation_exp
from pipeline.recording.loops import poses_by_tracking
from pipeline.recording.tracking import Track, Tracked
from pipeline.types import Link

FRAMES, WIDTH_PX = 10, 160
PEERS = [name for name in available_walk_peers() if name != "open3d-slam, fine voxels"]  # takes long
ELSEWHERE = rigid(rotation_exp(np.array([0.3, -0.2, 0.9])), np.array([1.0, -2.0, 0.5]))


@pytest.fixture(scope="module")
def walk(tmp_path_factory):
    (folder,) = held_out_walks(1, FRAMES, WIDTH_PX, tmp_path_factory.mktemp("walks"))
    return folder


def test_a_walk_is_rendered_once_and_read_completely(walk):
    image = walk / "depth" / "000000.png"
    before = image.stat().st_mtime_ns
    assert held_out_walks(1, FRAMES, WIDTH_PX, walk.parent) == [walk]
    assert image.stat().st_mtime_ns == before
    assert walk.name == f"{FIRST_ROOM}-{FRAMES}-{WIDTH_PX}"
    frames = frames_in_memory(walk, 5)
    assert frames.times_s == pytest.approx([0.0, 1.0 / 6.0], abs=1e-5)
    assert len(frames.frames) == len(frames.views) == 2
    assert frames.view(1).depth is frames.frame(1).depth


def test_walks_that_no_room_can_have_are_refused(tmp_path):
    with pytest.raises(InputError, match="at least 1"):
        held_out_walks(1, 0, WIDTH_PX, tmp_path)
    (tmp_path / "file").touch()
    with pytest.raises(InputError, match="cannot be written"):
        held_out_walks(1, FRAMES, WIDTH_PX, tmp_path / "file")


def test_a_full_room_is_left_out_and_a_full_disk_is_reported(tmp_path, monkeypatch):
    errors = [NoWalkError("the room is full"), InputError("the disk is full")]

    def render(*_):
        raise errors.pop(0)

    monkeypatch.setattr("lab.walks.held_out.render_walk", render)
    with pytest.raises(InputError, match="the disk is full"):
        held_out_walks(1, FRAMES, WIDTH_PX, tmp_path)


@pytest.mark.parametrize("program", [*OWN, *PEERS])
def test_every_program_follows_a_short_walk(walk, program):
    row = (solve_own if program in OWN else solve_peer)(WalkTask(program, walk, 1))
    assert (row["program"], row["walk"], row["frames"]) == (program, walk.name, FRAMES)
    assert row["without_pose"] == 0
    assert row["ate_m"] < (0.02 if program in OWN else 0.04)
    assert np.isnan(row["rpe_m"])  # shorter than a second
    if program in (OURS, "open3d-slam"):
        assert row["map_median_m"] < 0.03
        assert 0.3 < row["f_2cm"] <= row["f_5cm"] <= 1.0


def test_the_true_room_and_poses_have_no_errors_in_another_world(walk):
    truth = read_truth(walk)
    poses = [ELSEWHERE @ T for T in truth.T_world_camera]
    np.testing.assert_allclose(to_truth(poses, truth.T_world_camera), inverse(ELSEWHERE), atol=1e-9)
    mesh = Mesh(apply(ELSEWHERE, truth.vertices_m), truth.triangles)
    row = map_errors(poses, mesh.vertices_m, mesh, kinect(WIDTH_PX), truth, 1)
    assert row["map_median_m"] < 1e-5
    assert (row["f_2cm"], row["f_5cm"], row["without_surface"]) == (1.0, 1.0, 0.0)
    away = Mesh(mesh.vertices_m + 100.0, mesh.triangles)
    row = map_errors(poses, mesh.vertices_m, away, kinect(WIDTH_PX), truth, 1)
    assert (row["f_5cm"], row["without_surface"]) == (0.0, 1.0)
    errors = trajectory_errors(poses, np.arange(FRAMES) / 30.0, list(truth.T_world_camera), 1)
    assert errors["ate_m"] < 1e-9
    assert not errors["lost"]
    few = [*poses[:4], *[None] * (FRAMES - 4)]
    assert trajectory_errors(few, np.arange(FRAMES) / 30.0, list(truth.T_world_camera), 1)["lost"]


def test_a_wall_3_cm_off_and_one_that_is_missing_are_seen_in_scores_and_rays():
    def wall(x_m, half):
        corners = [(0.0, -2.0, -2.0), (0.0, half, -2.0), (0.0, half, 2.0), (0.0, -2.0, 2.0)]
        return np.array(corners) + np.array([x_m, 0.0, 0.0]), np.array([[0, 1, 2], [0, 2, 3]])

    camera, eye = kinect(WIDTH_PX), look_at(np.array([-1.5, 0.0, 0.0]), np.zeros(3))
    truth = WalkTruth(*wall(0.0, 2.0), np.array([eye]))
    row = surface_errors(Mesh(*wall(0.03, 2.0)), camera, truth)
    assert (row["f_2cm"], row["f_5cm"], row["without_surface"]) == (0.0, 1.0, 0.0)
    half = surface_errors(Mesh(*wall(0.0, 0.0)), camera, truth)  # precise, and half of what is looked at
    assert half["f_2cm"] == pytest.approx(2.0 * 0.5 / 1.5, abs=0.02)
    share = 0.5 - camera.fx_px * BESIDE_M / 1.5 / WIDTH_PX  # the left half is missing, seen from the right
    assert half["without_surface"] == pytest.approx(share, abs=0.01)
    assert surface_errors(Mesh(np.empty((0, 3)), np.empty((0, 3), int)), camera, truth)["f_5cm"] == 0.0


def test_a_recording_of_others_is_judged_by_its_poses_which_no_program_gets(walk, tmp_path):
    own = tmp_path / "own"
    shutil.copytree(walk, own, ignore=shutil.ignore_patterns(TRUTH, TRUE_POSES))
    with pytest.raises(InputError, match="own has no poses to compare with; try"):
        compared([own], 1, tmp_path)
    shutil.copy(walk / TRUE_POSES, own / "groundtruth.txt")
    assert frames_in_memory(own, 1).T_world_camera is None
    rows = [solve_own(WalkTask(OURS_TRACKING, folder, 1)) for folder in (walk, own)]
    assert rows[1]["ate_m"] == pytest.approx(rows[0]["ate_m"], rel=1e-3)
    assert rows[1]["path_m"] == pytest.approx(rows[0]["path_m"], rel=1e-3)
    assert rows[1]["map_median_m"] is None


def test_answers_on_a_walk_are_computed_again_if_its_files_change_and_only_then(tmp_path, monkeypatch):
    walks = [tmp_path / name for name in ("a", "b")]
    for walk in walks:
        walk.mkdir()
        (walk / "0.png").write_text("first")
    measured = []

    def measure(task):
        measured.append(task.folder.name)
        return {"program": task.program}

    for changed, names in ((None, ["a", "b"]), (None, []), (walks[1], ["b"])):
        if changed is not None:
            (changed / "0.png").write_text("second")
        trial_digest.cache_clear()
        measured.clear()
        assert len(recording._answers(("ours",), measure, walks, 1, tmp_path)) == 2
        assert measured == names


def test_a_steady_drift_is_the_relative_error_over_a_second():
    times_s = np.arange(61) / 30.0
    true = [
        rigid(rotation_exp(np.array([0.0, 0.02 * k, 0.0])), np.array([0.01 * k, 0.0, 0.0])) for k in range(61)
    ]
    assert rpe_m([ELSEWHERE @ T for T in true], true, times_s) == pytest.approx(0.0, abs=1e-12)
    drifting = [rigid(np.eye(3), np.array([0.001 * k, 0.0, 0.0])) for k in range(61)]
    still = [np.eye(4)] * 61
    assert rpe_m(drifting, still, times_s) == pytest.approx(0.03)
    assert rpe_m(drifting[::5], still[::5], times_s[::5]) == pytest.approx(0.03)
    assert np.isnan(rpe_m([None] * 61, still, times_s))


def test_tracked_poses_follow_the_links_and_other_parts_have_none():
    step = rigid(np.eye(3), np.array([1.0, 0.0, 0.0]))
    links = (Link(1, 0, step, np.eye(6), 0.9, 0.9, False), Link(2, 1, step, np.eye(6), 0.9, 0.9, False))
    frames = (*[Tracked(k, np.eye(4)) for k in range(3)], Tracked(2, step), None, Tracked(5, np.eye(4)))
    clouds = dict.fromkeys((0, 1, 2, 5), SimpleNamespace())
    poses = poses_by_tracking(Track(frames, clouds, links))
    assert [None if T is None else T[0, 3] for T in poses] == [0.0, 1.0, 2.0, 3.0, None, None]


def test_a_program_that_ends_its_process_has_no_poses_and_the_benchmark_goes_on(walk, monkeypatch):
    def crashes(function, *arguments):
        if function is peers.solve_peer:
            raise BrokenProcessPool
        return function(*arguments)

    monkeypatch.setattr(peers, "run_alone", crashes)
    row = peers.measure_peer(WalkTask("open3d-slam", walk, 1))
    assert (row["without_pose"], row["lost"], row["crashed"]) == (FRAMES, True, True)
    (group,) = summary([row])
    assert (group["crashed"], group["frames_s"], group["ate_m"]) == (1, None, None)


def test_a_summary_has_medians_and_worst_values_and_a_walk_without_poses_is_the_worst():
    def row(ate_m, within, lost=False, without_pose=0):
        values = {
            "rpe_m": 0.01,
            "frames": 10,
            "without_pose": without_pose,
            "map_median_m": 0.002,
            "f_5cm": 0.9,
            "without_surface": 0.1,
        }
        own = {
            "program": OURS,
            "every": 1,
            "lost": lost,
            "ate_m": ate_m,
            "f_2cm": within,
            "f_5cm": 0.9,
        }
        share = None if ate_m is None else ate_m / 10.0
        return values | own | {"ate_share": share, "frames_s": 20.0, "peak_memory_bytes": 5}

    (group,) = summary([row(0.01, 0.8), row(0.03, 0.7), row(0.02, 0.9)])
    assert (group["walks"], group["lost"]) == (3, 0)
    assert (group["ate_m"], group["worst_ate_m"]) == (0.02, 0.03)
    assert (group["f_2cm"], group["worst_f_2cm"]) == (0.8, 0.7)
    (group,) = summary([row(0.01, 0.8), row(0.03, 0.7), row(None, None, lost=True)])
    assert (group["ate_m"], group["worst_ate_m"], group["lost"]) == (0.03, None, 1)
    (group,) = summary([row(0.01, 0.8), row(0.02, 0.7), row(0.001, 0.1, lost=True, without_pose=6)])
    assert (group["ate_m"], group["worst_ate_m"], group["worst_without_pose"]) == (0.02, None, 6)
