"""Sequences with associations.txt, as ICL-NUIM and ORB-SLAM have them."""

import cv2
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from packetmesh.errors import InputError
from packetmesh.progress import drain
from pipeline.importing import iterate_import
from pipeline.io.rigs import load_rig
from pipeline.kernels.geometry import look_at, pixel_rays
from pipeline.types import CameraIntrinsics

CAMERA = CameraIntrinsics.pinhole(120.3, 120.0, 79.5, 59.5, 160, 120)
POSES = [look_at((0.4 * k, -1.5, 0.3 * k), (0.2, 1.0, -0.3), (0.1, 0.0, 1.0)) for k in range(3)]
MIRROR = np.diag([1.0, -1.0, 1.0, 1.0])
PLANES = np.array([[0.0, 1.0, 0.0, 1.0], [0.0, 0.0, -1.0, 0.8], [1.0, 0.0, 0.0, 1.6], [-1.0, 0.0, 0.0, 1.2]])
"""Walls n . X = d of a corner, in the world: ahead, below, right and left."""


def depth_of(T):
    """Distance along z to the nearest wall, (H, W)."""
    rays = pixel_rays(CAMERA) @ T[:3, :3].T
    nearing = rays @ PLANES[:, :3].T
    distances = PLANES[:, 3] - PLANES[:, :3] @ T[:3, 3]
    with np.errstate(divide="ignore"):
        return np.where(nearing > 1e-9, distances / nearing, np.inf).min(axis=-1)


def write(folder, order="depth first", poses=POSES, trajectory="livingRoom1.gt.freiburg", start=0):
    lines, rows = [], []
    for k, T in enumerate(POSES):
        for name in ("rgb", "depth"):
            (folder / name).mkdir(parents=True, exist_ok=True)
        cv2.imwrite(str(folder / "rgb" / f"{k}.png"), np.full((120, 160, 3), 60 * k, np.uint8))
        cv2.imwrite(str(folder / "depth" / f"{k}.png"), np.rint(5000.0 * depth_of(T)).astype(np.uint16))
        pair = [f"{start + k} depth/{k}.png", f"{start + k} rgb/{k}.png"]
        lines.append(" ".join(pair if order == "depth first" else pair[::-1]))
        values = [*poses[k][:3, 3], *Rotation.from_matrix(poses[k][:3, :3]).as_quat()]
        rows.append(f"{start + k} " + " ".join(f"{value:.9f}" for value in values))
    (folder / "associations.txt").write_text("\n".join(lines) + "\n")
    if trajectory:
        (folder / trajectory).write_text("\n".join(rows) + "\n")
    np.savetxt(folder / "intrinsics.txt", CAMERA.matrix)


def imported(tmp_path, **options):
    report = drain(iterate_import(tmp_path / "recording", tmp_path / "rig", **options))
    return report, load_rig(tmp_path / "rig").frames


def steps(poses):
    return [np.linalg.inv(poses[0]) @ T for T in poses[1:]]


@pytest.mark.parametrize("order", ["depth first", "colour first"])
@pytest.mark.parametrize("trajectory", ["livingRoom1.gt.freiburg", "groundtruth.txt"])
def test_pairs_scale_and_poses_are_those_of_the_files(tmp_path, order, trajectory):
    write(tmp_path / "recording", order, trajectory=trajectory)
    report, frames = imported(tmp_path)
    assert report.kind == "ICL-NUIM or ORB-SLAM"
    assert report.depth_scale == 5000.0
    assert any("5000 units in a metre; --depth-scale names others" in note for note in report.notes)
    for k, (frame, T) in enumerate(zip(frames, POSES, strict=True)):
        assert frame.rgb[0, 0, 0] == 60 * k
        np.testing.assert_allclose(frame.depth.z_m, depth_of(T), atol=6e-4)
        np.testing.assert_allclose(frame.T_world_camera, T, atol=1e-6)


def test_poses_with_y_up_are_mirrored_as_the_depth_tells(tmp_path):
    """ICL-NUIM's fy of -480 means x = (u - cx) z / fx, y = -(v - cy) z / 480: both frames are left-handed."""
    write(tmp_path / "recording", poses=[MIRROR @ T @ MIRROR for T in POSES])
    report, frames = imported(tmp_path)
    for found, expected in zip(steps([frame.T_world_camera for frame in frames]), steps(POSES), strict=True):
        np.testing.assert_allclose(found, expected, atol=1e-6)
    assert any("its poses were mirrored" in note for note in report.notes)


def test_without_poses_the_file_that_is_missing_is_named(tmp_path):
    write(tmp_path / "recording", trajectory=None)
    report, _ = imported(tmp_path)
    assert any("No groundtruth.txt or .gt.freiburg: poses are not known" in note for note in report.notes)


def test_the_camera_of_icl_nuim_is_assumed_for_its_size_and_said(tmp_path):
    write(tmp_path / "recording")
    (tmp_path / "recording" / "intrinsics.txt").unlink()
    says = "has 160 x 120 pixels, not the 640 x 480 of the camera that would be assumed .those of ICL-NUIM"
    with pytest.raises(InputError, match=says):
        imported(tmp_path)
    for path in [*(tmp_path / "recording").glob("*/*.png")]:
        image = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
        cv2.imwrite(str(path), cv2.resize(image, (640, 480), interpolation=cv2.INTER_NEAREST))
    report, frames = imported(tmp_path)
    K = frames[0].intrinsics
    assert (K.fx_px, K.fy_px, K.cx_px, K.cy_px) == (481.2, 480.0, 319.5, 239.5)
    assert any("taken as those of ICL-NUIM" in note for note in report.notes)


def test_the_same_line_twice_is_one_moment(tmp_path):
    write(tmp_path / "recording")
    file = tmp_path / "recording" / "associations.txt"
    file.write_text(file.read_text() * 2)
    report, frames = imported(tmp_path, frames=6)
    assert len(frames) == 3
    assert report.candidates == 3


def test_images_that_are_missing_are_named_and_then_found(tmp_path):
    write(tmp_path / "recording")
    (tmp_path / "recording" / "rgb").rename(tmp_path / "away")
    with pytest.raises(InputError, match=r"rgb/0.png; try to unpack the images next to it"):
        imported(tmp_path)
    (tmp_path / "away").rename(tmp_path / "recording" / "rgb")
    (tmp_path / "recording" / "rgb" / "1.png").unlink()
    report, frames = imported(tmp_path)
    assert len(frames) == 2
    assert any("Files of 1 of 3 lines of associations.txt do not exist" in note for note in report.notes)


def test_a_line_of_another_form_is_quoted(tmp_path):
    write(tmp_path / "recording")
    (tmp_path / "recording" / "associations.txt").write_text("0 depth/0.png\n")
    with pytest.raises(InputError, match=r"the line '0 depth/0.png'; try lines with a time .* twice"):
        imported(tmp_path)


@pytest.mark.parametrize("order", ["depth first", "colour first"])
def test_a_blank_first_depth_image_is_still_depth(tmp_path, order):
    write(tmp_path / "recording", order)
    cv2.imwrite(str(tmp_path / "recording" / "depth" / "0.png"), np.zeros((120, 160), np.uint16))
    _, frames = imported(tmp_path)
    assert [int(frame.rgb[0, 0, 0]) for frame in frames] == [60, 120]
    for frame, T in zip(frames, POSES[1:], strict=True):
        np.testing.assert_allclose(frame.depth.z_m, depth_of(T), atol=6e-4)


def test_a_scale_that_is_given_is_not_said_to_be_assumed(tmp_path):
    write(tmp_path / "recording")
    report, _ = imported(tmp_path, depth_scale=2500.0)
    assert any("Depth: 2500 units in a metre" in note for note in report.notes)
    assert not any("5000" in note for note in report.notes)


@pytest.mark.parametrize("mirror", [np.eye(4), MIRROR])
def test_depth_tells_at_its_own_scale_whether_poses_have_y_up(tmp_path, mirror):
    """A camera that rises over a floor, in millimetres; with 5000 units in a metre both answers are wrong."""
    rising = [look_at((0.0, -1.0, 0.2 * k), (0.0, 0.0, 0.2 * k - 0.8)) for k in range(3)]
    write(tmp_path / "recording", poses=[mirror @ T @ mirror for T in rising])
    for k, T in enumerate(rising):
        units = np.rint(1000.0 * depth_of(T)).astype(np.uint16)
        cv2.imwrite(str(tmp_path / "recording" / "depth" / f"{k}.png"), units)
    _, frames = imported(tmp_path, depth_scale=1000.0)
    for found, expected in zip(steps([frame.T_world_camera for frame in frames]), steps(rising), strict=True):
        np.testing.assert_allclose(found, expected, atol=1e-6)


def test_depth_in_millimetres_opens_with_the_option_that_the_note_names(tmp_path):
    write(tmp_path / "recording")
    _, frames = imported(tmp_path, depth_scale=1000.0)
    np.testing.assert_allclose(frames[0].depth.z_m, 5.0 * depth_of(POSES[0]), atol=6e-4)
