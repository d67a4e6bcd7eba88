"""Poses of real recordings are rotations only to some digits; what is none is refused with the reason."""

import json
import logging

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from packetmesh.errors import InputError
from pipeline.io.extrinsics import read_extrinsics_noted
from pipeline.io.poses import departure, nearest_rigid, read_pose, read_pose_noted, write_pose
from pipeline.io.rigs import load_rig, save_rig
from pipeline.kernels.geometry import look_at, rigid
from tests.pipeline.importing.recordings import orbit

T = rigid(Rotation.from_rotvec([0.3, -1.1, 0.7]).as_matrix(), np.array([0.5, -2.0, 1.5]))


def bent(off: float) -> np.ndarray:
    """A pose whose first row is longer, so that it departs from orthonormal by ``off``."""
    changed = T.copy()
    changed[:3, :3] = np.diag([np.sqrt(1.0 + off), 1.0, 1.0]) @ T[:3, :3]
    return changed


def written(path, matrix):
    np.savetxt(path, matrix, fmt="%.17g")
    return path


def test_the_nearest_rotation_is_that_of_an_orthogonal_procrustes_problem(tmp_path):
    """scipy solves it for the axes themselves."""
    rng = np.random.default_rng(4)
    noisy = T.copy()
    noisy[:3, :3] += 1e-3 * rng.normal(size=(3, 3))
    found = read_pose(written(tmp_path / "pose.txt", noisy))
    expected, _ = Rotation.align_vectors(noisy[:3, :3].T, np.eye(3))
    np.testing.assert_allclose(found[:3, :3], expected.as_matrix(), atol=1e-9)
    assert departure(found) < 1e-12
    np.testing.assert_array_equal(found[:3, 3], noisy[:3, 3])


@pytest.mark.parametrize(("off", "kept", "notes"), [(5e-5, True, 0), (5e-4, False, 0), (5e-3, False, 1)])
def test_a_pose_is_kept_or_rounded_and_said_by_its_departure(tmp_path, off, kept, notes):
    found, said = read_pose_noted(written(tmp_path / "pose.txt", bent(off)))
    assert np.array_equal(found, bent(off)) is kept
    np.testing.assert_allclose(found, T, atol=1e-4 if kept else 1e-12)
    assert len(said) == notes
    assert all("pose.txt is orthonormal only to 0.005" in note for note in said)


def test_a_pose_of_a_node_that_was_rounded_is_a_note_of_the_node(tmp_path):
    save_rig(tmp_path / "rig", orbit(1))
    written(tmp_path / "rig" / "node_00" / "pose.txt", bent(5e-3))
    (frame,) = load_rig(tmp_path / "rig").frames
    np.testing.assert_allclose(frame.T_world_camera, T, atol=1e-12)
    assert any("nearest rotation" in note for note in frame.notes)


def test_a_start_pose_that_was_rounded_is_logged(tmp_path, caplog):
    with caplog.at_level(logging.WARNING):
        read_pose(written(tmp_path / "init.txt", bent(5e-3)))
    assert "nearest rotation" in caplog.text


@pytest.mark.parametrize(
    ("matrix", "why"),
    [
        (bent(0.05), "orthonormal only to 0.05, not to 0.01"),
        (np.diag([2.0, 2.0, 2.0, 1.0]), "it enlarges by 2"),
        (np.diag([1.0, 1.0, -1.0, 1.0]), "it mirrors"),
        (T.T, "its last line is 0.5 -2 1.5 1, as if it were transposed"),
        (np.vstack([T[:3], [0.0, 0.0, 0.0, 2.0]]), "its last line is 0 0 0 2"),
    ],
)
def test_what_is_no_pose_is_refused_with_what_it_is(tmp_path, matrix, why):
    with pytest.raises(InputError, match=f"pose.txt is not a rigid transform: .*{why}"):
        read_pose(written(tmp_path / "pose.txt", matrix))
    assert nearest_rigid(matrix) is None


def test_a_pose_may_be_one_line_or_have_other_line_ends(tmp_path):
    write_pose(tmp_path / "pose.txt", T)
    text = (tmp_path / "pose.txt").read_text()
    for other in (
        text.replace("\n", " "),
        text.replace("\n", "\r\n"),
        text.replace("\n", "\r"),
        "\ufeff" + text,
        text.replace(" ", "\t"),
        text.replace(" ", ", "),
    ):
        (tmp_path / "pose.txt").write_bytes(other.encode())
        np.testing.assert_array_equal(read_pose(tmp_path / "pose.txt"), T)
    (tmp_path / "pose.txt").write_bytes(text.encode("utf-16"))  # as PowerShell's > writes it
    np.testing.assert_array_equal(read_pose(tmp_path / "pose.txt"), T)


def test_extrinsics_are_rounded_and_refused_as_poses(tmp_path):
    path = tmp_path / "extrinsics.json"
    path.write_text(f'{{"T_color_depth": {bent(5e-3).tolist()}}}')
    found, notes = read_extrinsics_noted(path)
    np.testing.assert_allclose(found, T, atol=1e-12)
    assert len(notes) == 1
    path.write_text(f'{{"T_color_depth": {T.T.tolist()}}}')
    with pytest.raises(InputError, match="as if it were transposed; try"):
        read_extrinsics_noted(path)
    path.write_text(f'{{"T_depth_color": {T.tolist()}}}')
    with pytest.raises(InputError, match="has no T_color_depth but T_depth_color; try"):
        read_extrinsics_noted(path)


def test_a_node_with_an_undefined_pose_opens_when_the_pose_is_removed(tmp_path):
    """The remedy of the message."""
    save_rig(tmp_path / "rig", orbit(1))
    pose = written(tmp_path / "rig" / "node_00" / "pose.txt", np.full((4, 4), np.nan))
    with pytest.raises(InputError, match=r"not all finite; try .* remove the file"):
        load_rig(tmp_path / "rig")
    pose.unlink()
    assert not load_rig(tmp_path / "rig").frames[0].pose_known


def test_exact_poses_stay_as_they_are(tmp_path):
    exact = look_at((1.0, 2.0, 1.5), (0.0, 0.0, 1.0))
    write_pose(tmp_path / "pose.txt", exact)
    np.testing.assert_array_equal(read_pose(tmp_path / "pose.txt"), exact)


@pytest.mark.parametrize(
    "form",
    [
        lambda T: str(T.tolist()),
        repr,
        str,
        lambda T: "".join(" ".join(map(repr, row)) + "\n" for row in T[:3].tolist()),
        lambda T: " ".join(map(repr, T[:3].ravel().tolist())) + "\n",
        lambda T: ";\n".join(" ".join(map(repr, row)) for row in T.tolist()),
        lambda T: json.dumps(T.tolist(), indent=1),
    ],
    ids=["list", "repr", "str", "3 x 4", "KITTI", "MATLAB", "JSON"],
)
def test_a_pose_may_be_as_other_programs_print_it(tmp_path, form):
    (tmp_path / "pose.txt").write_text(form(T))
    np.testing.assert_allclose(read_pose(tmp_path / "pose.txt"), T, atol=1e-7)


@pytest.mark.parametrize(
    "text",
    ["1 2 3 0 0 0 1", "1 0 0 1\n0 1 0 2\n0 0 1 0.4", "1 0 0\n0 1 0\n0 0 1\n0 0 0", "1,5 0,0 0,0 2,5\n" * 4],
)
def test_other_counts_of_numbers_are_no_pose(tmp_path, text):
    (tmp_path / "pose.txt").write_text(text)
    with pytest.raises(
        InputError, match=r"does not hold 4 x 4 numbers but lines of .* try four lines of four"
    ):
        read_pose(tmp_path / "pose.txt")
