"""Recordings opened in place: frames are those that were written, and their depth has a pinhole camera."""

import cv2
import numpy as np
import pytest

from packetmesh.errors import InputError
from pipeline.importing.depth_views import DepthCamera, view_of
from pipeline.importing.recorded import FRAMES_PER_S, FolderRecording, open_recording
from pipeline.io.depth_to_color import register_depth
from pipeline.io.images import NoDepthError, write_color
from pipeline.io.intrinsics import write_intrinsics
from pipeline.kernels.geometry import inverse, pixel_rays, project, rigid, rotation_exp
from pipeline.types import CameraIntrinsics
from tests.pipeline.importing.phone_captures import (
    PHOTO,
    photograph,
    write_polycam,
    write_record3d,
    write_stray,
)
from tests.pipeline.importing.recordings import (
    CAMERA,
    LAYOUTS,
    orbit,
    write_scannet,
    write_seven_scenes,
    write_tum,
)
from tests.pipeline.lenses import KIND, by_opencv, camera
from tests.pipeline.strangers.containers import write_r3d
from tests.pipeline.strangers.phones import write_scanner_app

NORMAL, OFFSET_M = np.array([0.28, -0.2, 0.9390]), 1.6
"""A tilted wall normal . p = offset in the camera's frame."""


def units(path, values):
    cv2.imwrite(str(path), np.rint(values).astype(np.uint16))


def plane(own: CameraIntrinsics) -> np.ndarray:
    """(H, W) depth of the tilted wall."""
    return OFFSET_M / (pixel_rays(own) @ NORMAL)


@pytest.mark.parametrize("kind", LAYOUTS)
def test_every_frame_of_a_recording_is_there_in_order(tmp_path, kind):
    written = orbit(5)
    LAYOUTS[kind](tmp_path / "recording", written)
    recording = open_recording(tmp_path / "recording")
    assert (recording.kind, recording.name) == (kind, "recording")
    assert len(recording.times_s) == len(recording.T_world_camera) == 5
    for k, expected in enumerate(written.frames):
        view, frame = recording.view(k), recording.frame(k)
        np.testing.assert_array_equal(view.depth.z_m, expected.depth.z_m)
        np.testing.assert_array_equal(view.camera.matrix, CAMERA.matrix)
        np.testing.assert_array_equal(view.T_color_depth, np.eye(4))
        assert view.weight is None
        np.testing.assert_array_equal(frame.rgb, expected.rgb)
        np.testing.assert_array_equal(frame.depth.z_m, expected.depth.z_m)
        np.testing.assert_allclose(frame.T_world_camera, expected.T_world_camera, atol=1e-6)
        np.testing.assert_array_equal(frame.T_world_camera, recording.T_world_camera[k])
        assert (frame.name, frame.pose_known) == (f"frame_{k:05d}", True)


def test_times_are_those_of_the_recording_or_thirty_a_second(tmp_path):
    write_tum(tmp_path / "tum", orbit(4))
    times_s = open_recording(tmp_path / "tum").times_s
    np.testing.assert_allclose(times_s, 1305031452.79 + np.arange(4) / 30.0, atol=1e-6)
    write_seven_scenes(tmp_path / "scenes", orbit(4))
    np.testing.assert_allclose(open_recording(tmp_path / "scenes").times_s, np.arange(4) / FRAMES_PER_S)
    write_stray(tmp_path / "stray", orbit(4))
    np.testing.assert_allclose(open_recording(tmp_path / "stray").times_s, 0.1 * np.arange(4))


def test_lists_in_any_order_give_frames_in_order_of_time(tmp_path):
    folder, written = tmp_path / "tum", orbit(4)
    write_tum(folder, written)
    for name in ("rgb.txt", "depth.txt"):
        lines = (folder / name).read_text().splitlines()
        (folder / name).write_text("\n".join(lines[::-1]) + "\n")
    recording = open_recording(folder)
    assert (np.diff(recording.times_s) > 0.0).all()
    for k, expected in enumerate(written.frames):
        np.testing.assert_array_equal(recording.frame(k).rgb, expected.rgb)
        np.testing.assert_array_equal(recording.view(k).depth.z_m, expected.depth.z_m)


def test_without_poses_there_are_none_and_frames_stand_level(tmp_path):
    write_tum(tmp_path, orbit(2))
    (tmp_path / "groundtruth.txt").unlink()
    recording = open_recording(tmp_path)
    assert recording.T_world_camera is None
    assert not any("poses are not known" in note for note in recording.notes)
    frame = recording.frame(0)
    assert not frame.pose_known
    np.testing.assert_allclose(frame.T_world_camera[:3, 2], [0, 1, 0], atol=1e-12)


def test_images_are_read_only_when_they_are_requested(tmp_path):
    write_tum(tmp_path, orbit(3))
    recording = open_recording(tmp_path)
    last = sorted((tmp_path / "depth").iterdir())[2]
    last.write_bytes(b"no image")
    recording.view(1)
    assert len(recording.notes) == len(recording.sequence.notes)
    assert not recording.view(2).depth.valid.any()
    assert last.name in recording.notes[-1]
    assert recording.notes[-1].startswith("1 depth image could not be used: ")


def test_depth_in_fewer_pixels_than_the_first_one_keeps_its_view(tmp_path):
    written = orbit(2)
    write_tum(tmp_path, written)
    whole = written.frames[1].depth.z_m
    path = sorted((tmp_path / "depth").iterdir())[1]
    units(path, np.nan_to_num(5000.0 * whole[::2, ::2]).round())
    recording = open_recording(tmp_path)
    assert recording.view(1).camera.fx_px == 0.5 * recording.view(0).camera.fx_px
    assert recording.frame(1).depth.z_m.shape == whole.shape
    assert recording.notes == recording.sequence.notes


def test_frame_and_view_have_the_same_camera_where_each_frame_has_its_own(tmp_path):
    """Polycam's photographs are larger than its depth, and every one has its own focal length."""
    write_polycam(tmp_path, orbit(3))
    recording = open_recording(tmp_path)
    for k in range(3):
        view, frame = recording.view(k), recording.frame(k)
        expected = register_depth(view.depth, view.camera, frame.intrinsics, np.eye(4))
        np.testing.assert_array_equal(frame.depth.z_m, expected.z_m)


def test_a_scale_that_is_given_counts(tmp_path):
    written = orbit(2)
    write_tum(tmp_path, written)
    z_m = open_recording(tmp_path, depth_scale=1250.0).view(1).depth.z_m
    np.testing.assert_allclose(z_m, 4.0 * written.frames[1].depth.z_m, rtol=1e-6)


def with_lens(folder, own: CameraIntrinsics) -> FolderRecording:
    """A recording of two frames of the tilted wall by a camera with a lens."""
    (folder / "depth").mkdir(parents=True)
    for k in range(2):
        write_color(folder / "color" / f"{k}.png", np.zeros((own.height_px, own.width_px, 3), np.uint8))
        units(folder / "depth" / f"{k}.png", 10_000.0 * plane(own))
    write_intrinsics(folder / "lens.json", own)
    return open_recording(folder, 10_000.0, folder / "lens.json")


@pytest.mark.parametrize("kind", KIND)
def test_a_plane_through_a_lens_is_a_plane_again(tmp_path, kind):
    """Each pixel has the nearest one's depth: within half a pixel's slope each way, and right in the mean."""
    lens = camera(kind)
    recording = with_lens(tmp_path, lens)
    view = recording.view(1)
    assert not view.camera.fisheye
    np.testing.assert_array_equal(view.camera.distortion, np.zeros(5))
    np.testing.assert_array_equal(view.camera.matrix, lens.matrix)
    expected_m = plane(view.camera)
    slopes = [np.abs(slope) for slope in np.gradient(plane(lens))]
    known = view.depth.valid
    away_m = (view.depth.z_m - expected_m)[known]
    assert np.abs(away_m).max() < 0.5 * (slopes[0].max() + slopes[1].max()) + 1e-4
    assert abs(away_m.mean()) < 3e-4
    points_m = (pixel_rays(view.camera) * view.depth.z_m[..., None])[known]
    assert np.abs(points_m @ NORMAL - OFFSET_M).mean() < 0.004
    pixels = by_opencv(lens, pixel_rays(view.camera).reshape(-1, 3)).reshape(240, 320, 2)
    inside = np.all((pixels > 0.0) & (pixels < (319.0, 239.0)), axis=-1)
    reached = np.isfinite(project(lens, pixel_rays(view.camera).reshape(-1, 3))).all(axis=1).reshape(240, 320)
    assert known[inside & reached].all()
    beyond = np.any((pixels < -1.0) | (pixels > (320.0, 240.0)), axis=-1)
    assert not known[beyond | ~reached].any()


def test_the_frame_through_a_lens_keeps_its_pixels(tmp_path):
    lens = camera("brown")
    frame = with_lens(tmp_path, lens).frame(0)
    np.testing.assert_array_equal(frame.intrinsics.distortion, lens.distortion)
    np.testing.assert_allclose(frame.depth.z_m, plane(lens), atol=6e-5)


def test_a_depth_camera_of_its_own_is_kept_in_views_and_registered_in_frames(tmp_path):
    """The tilted wall is known in the colour camera's frame."""
    write_scannet(tmp_path, orbit(2))
    depth_camera = CameraIntrinsics.pinhole(14.0, 14.5, 9.3, 7.2, 20, 15)
    T_body_color = rigid(rotation_exp(np.array([0.02, 0.1, 0.0])), np.array([0.0, 0.01, 0.0]))
    T_body_depth = rigid(rotation_exp(np.array([0.0, 0.03, 0.02])), np.array([0.06, 0.0, -0.02]))
    T_color_depth = inverse(T_body_color) @ T_body_depth
    rays = pixel_rays(depth_camera) @ T_color_depth[:3, :3].T
    z_m = (OFFSET_M - NORMAL @ T_color_depth[:3, 3]) / (rays @ NORMAL)
    for k in range(2):
        units(tmp_path / "depth" / f"{k}.png", 1000.0 * z_m)
    matrix = np.eye(4)
    matrix[:3, :3] = depth_camera.matrix
    np.savetxt(tmp_path / "intrinsic" / "intrinsic_depth.txt", matrix)
    np.savetxt(tmp_path / "intrinsic" / "extrinsic_color.txt", T_body_color)
    np.savetxt(tmp_path / "intrinsic" / "extrinsic_depth.txt", T_body_depth)
    recording = open_recording(tmp_path)
    view, frame = recording.view(1), recording.frame(1)
    np.testing.assert_allclose(view.depth.z_m, z_m, atol=5.1e-4)
    np.testing.assert_allclose(view.camera.matrix, depth_camera.matrix)
    assert (view.camera.width_px, view.camera.height_px) == (20, 15)
    np.testing.assert_allclose(view.T_color_depth, T_color_depth, atol=1e-9)
    np.testing.assert_array_equal(frame.intrinsics.matrix, CAMERA.matrix)
    known = frame.depth.valid
    assert known.mean() > 0.8
    away_m = np.abs(frame.depth.z_m - plane(CAMERA))[known]
    assert away_m.max() < 0.01
    assert away_m.mean() < 0.001


@pytest.mark.parametrize("matrix", [True, False], ids=["camera_matrix.csv", "odometry.csv"])
def test_small_depth_has_the_colour_camera_resized(tmp_path, matrix):
    """Of Stray Scanner: 40 x 30 pixels of depth and photographs of 120 x 90."""
    written = orbit(3)
    write_stray(tmp_path / "capture", written, matrix=matrix)
    recording = open_recording(tmp_path / "capture")
    for k, expected in enumerate(written.frames):
        view, frame = recording.view(k), recording.frame(k)
        np.testing.assert_allclose(view.depth.z_m, expected.depth.z_m, atol=1e-6)
        np.testing.assert_allclose(view.camera.matrix, CAMERA.matrix, atol=1e-12)
        assert (view.camera.width_px, view.camera.height_px) == (40, 30)
        np.testing.assert_array_equal(view.T_color_depth, np.eye(4))
        np.testing.assert_array_equal(frame.rgb, photograph(expected))
        np.testing.assert_array_equal(frame.intrinsics.matrix, PHOTO.matrix)
        assert frame.depth.z_m.shape == (90, 120)
        middles_m = frame.depth.z_m[1::3, 1::3]
        both = np.isfinite(middles_m) & expected.depth.valid
        assert both.sum() > 0.9 * expected.depth.valid.sum()
        np.testing.assert_allclose(np.median(np.abs(middles_m - expected.depth.z_m)[both]), 0.0, atol=1e-3)


@pytest.mark.parametrize("kind", ["Polycam", "Record3D"])
def test_every_view_has_the_camera_of_its_frame(tmp_path, kind):
    if kind == "Polycam":
        write_polycam(tmp_path / "capture", orbit(3))
    else:
        write_record3d(tmp_path / "capture", orbit(3), each=True)
    recording = open_recording(tmp_path / "capture")
    assert [recording.view(k).camera.fx_px for k in range(3)] == pytest.approx([30.0, 91 / 3, 92 / 3])
    assert [recording.frame(k).intrinsics.fx_px for k in range(3)] == [90.0, 91.0, 92.0]


@pytest.mark.parametrize("blind", [0, 1])
@pytest.mark.parametrize("kind", ["TUM", "7-Scenes"])
def test_a_frame_without_depth_is_unknown_everywhere(tmp_path, kind, blind):
    LAYOUTS[kind](tmp_path, orbit(3))
    paths = sorted(tmp_path.rglob("*.png" if kind == "TUM" else "*.depth.png"))
    depths = [path for path in paths if kind != "TUM" or path.parent.name == "depth"]
    units(depths[blind], np.zeros((30, 40)))
    recording = open_recording(tmp_path)
    assert len(recording.times_s) == 3
    for k in range(3):
        view = recording.view(k)
        assert view.depth.z_m.shape == (30, 40)
        assert view.depth.z_m.dtype == np.float32
        assert view.depth.valid.any() == (k != blind)
        np.testing.assert_array_equal(view.camera.matrix, CAMERA.matrix)
    with pytest.raises(NoDepthError, match="no depth anywhere"):
        recording.frame(blind)


@pytest.mark.parametrize("blind", [0, 1])
def test_depth_of_the_lowest_confidence_is_unknown_also_if_it_is_all_of_a_frame(tmp_path, blind):
    written = orbit(2)
    write_stray(tmp_path, written, low=True)
    cv2.imwrite(str(tmp_path / "confidence" / f"{blind:06d}.png"), np.zeros((30, 40), np.uint8))
    recording = open_recording(tmp_path)
    assert not recording.view(blind).depth.valid.any()
    known = recording.view(1 - blind).depth.valid
    assert not known[:, :20].any()
    np.testing.assert_array_equal(known[:, 20:], written.frames[1 - blind].depth.valid[:, 20:])


def levels_of(high: int, medium: int) -> np.ndarray:
    """(30, 40): a third of low, of medium and of high confidence."""
    levels = np.full((30, 40), high, np.uint8)
    levels[:10], levels[10:20] = 0, medium
    return levels


def stray(folder, levels):
    write_stray(folder, orbit(2))
    return [folder / "confidence" / f"{k:06d}.png" for k in range(2)]


def polycam(folder, levels):
    write_polycam(folder, orbit(2))
    return list((folder / "keyframes" / "confidence").iterdir())


def scanner_app(folder, levels):
    write_scanner_app(folder, orbit(2))
    return [folder / depth.name.replace("depth", "conf") for depth in folder.glob("depth_*.png")]


def r3d(folder, levels):
    write_r3d(folder, orbit(2), confidence=levels)
    return []


@pytest.mark.parametrize(
    ("write", "high", "medium"),
    [(stray, 2, 1), (scanner_app, 2, 1), (r3d, 2, 1), (polycam, 255, 127), (polycam, 255, 54)],
)
def test_medium_confidence_counts_a_quarter_whatever_the_app_calls_it(tmp_path, write, high, medium):
    """ARKit's 0, 1, 2; Polycam's 0, 127, 255 by its documents, and 0, 54, 255 in its files."""
    levels = levels_of(high, medium)
    for path in write(tmp_path / "capture", levels):
        cv2.imwrite(str(path), levels)
    recording = open_recording(tmp_path / "capture")
    view = recording.view(1)
    assert not view.depth.valid[:10].any()
    assert view.depth.valid[10:].mean() > 0.9
    np.testing.assert_array_equal(view.weight[10:20], 0.25)
    np.testing.assert_array_equal(view.weight[20:], 1.0)
    (note,) = (note for note in recording.notes if "confidence" in note)
    assert "lowest confidence (0) is left out" in note
    assert "medium confidence counts 0.25 in the map of a camera that walks, and 1 elsewhere" in note


def test_a_view_that_cannot_be_read_has_no_weight(tmp_path):
    """Depth that is out of proportion, with confidence of its own size."""
    for path in stray(tmp_path / "capture", None)[1:]:
        cv2.imwrite(str(path), np.full((24, 40), 2, np.uint8))
    units(tmp_path / "capture" / "depth" / "000001.png", np.full((24, 40), 2000))
    recording = open_recording(tmp_path / "capture")
    view = recording.view(1)
    assert view.depth.z_m.shape == (30, 40)
    assert not view.depth.valid.any()
    assert view.weight is None
    assert any("1 depth image could not be used" in note for note in recording.notes)


def test_confidence_moves_with_the_depth_of_a_bent_lens():
    """Depth and weight differ from column to column, so that a wrong pixel would be seen."""
    bent = CameraIntrinsics(CAMERA.matrix, np.array([-0.3, 0.1, 0.0, 0.0, 0.0]), 40, 30)
    columns = np.tile(np.arange(40, dtype=np.float32), (30, 1))
    straight = view_of(1.0 + columns, DepthCamera(bent, np.eye(4)), 0.01 * columns)
    known = straight.depth.valid
    assert known.mean() > 0.5
    np.testing.assert_allclose(straight.weight[known], 0.01 * (straight.depth.z_m[known] - 1.0), atol=1e-6)
    assert not np.array_equal(straight.depth.z_m, 1.0 + columns)


def all_blind(folder):
    write_tum(folder, orbit(2))
    for path in (folder / "depth").iterdir():
        units(path, np.zeros((30, 40)))


def other_view(folder):
    write_tum(folder, orbit(2))
    for path in (folder / "depth").iterdir():
        units(path, np.full((15, 24), 9000))


def other_color(folder):
    write_seven_scenes(folder, orbit(2))
    write_color(folder / "frame-000001.color.png", np.zeros((60, 80, 3), np.uint8))


def some_bag(folder):
    folder.mkdir()
    (folder / "room.bag").write_bytes(b"#ROSBAG V2.0\n")


def read_all(folder):
    recording = open_recording(folder)
    for k in range(len(recording.times_s)):
        recording.view(k)
        recording.frame(k)


@pytest.mark.parametrize(
    ("spoil", "says"),
    [
        (lambda folder: None, "does not exist"),
        (lambda folder: folder.mkdir(), "of no known kind"),
        (lambda folder: folder.write_text("a letter"), "is a file"),
        (some_bag, "room.bag"),
        (all_blind, "No frame of .* has depth; check the depth images and the depth scale"),
        (other_view, r"24 x 15 pixels but .* 40 x 30, whose sides .*; try a recording whose depth"),
        (other_color, r"has 80 x 60 pixels and its camera 40 x 30; try --intrinsics"),
    ],
)
def test_what_cannot_be_used_gets_one_sentence(tmp_path, spoil, says):
    spoil(tmp_path / "recording")
    with pytest.raises(InputError, match=says) as error:
        read_all(tmp_path / "recording")
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("scale", [0.0, -1.0, np.nan, np.inf])
def test_a_scale_that_cannot_be_is_refused(tmp_path, scale):
    write_tum(tmp_path, orbit(2))
    with pytest.raises(InputError, match=r"The depth scale is .*; try 1000 for images in millimetres"):
        open_recording(tmp_path, depth_scale=scale)


def test_of_a_long_recording_every_nth_frame_is_used(tmp_path, monkeypatch):
    monkeypatch.setattr("pipeline.importing.recorded.MOST_FRAMES", 3)
    write_tum(tmp_path / "recording", orbit(7))
    recording = open_recording(tmp_path / "recording")
    monkeypatch.setattr("pipeline.importing.recorded.MOST_FRAMES", 7)
    every = open_recording(tmp_path / "recording")
    np.testing.assert_array_equal(recording.times_s, every.times_s[[0, 3, 6]])
    np.testing.assert_array_equal(recording.T_world_camera[2], every.T_world_camera[6])
    np.testing.assert_array_equal(recording.frame(1).rgb, every.frame(3).rgb)
    assert "One in 3 of the 7 frames is used, by number and not by motion (at most 3)" in recording.notes
    assert not any("One in" in note for note in every.notes)


def test_a_damaged_first_depth_image_is_left_out_like_any_other(tmp_path):
    write_tum(tmp_path / "recording", orbit(3))
    first = min((tmp_path / "recording" / "depth").iterdir())
    first.write_bytes(first.read_bytes()[:40])
    recording = open_recording(tmp_path / "recording")
    assert not recording.view(0).depth.valid.any()
    assert recording.view(0).depth.z_m.shape == recording.view(1).depth.z_m.shape
    assert recording.view(1).depth.valid.any()
    assert any(first.name in note for note in recording.notes)


def test_photographs_that_cannot_be_used_are_counted_and_the_first_is_named(tmp_path):
    """One is cut off, one has another size; both are noted when they are asked for, and only once."""
    write_seven_scenes(tmp_path, orbit(4))
    cut, other = (tmp_path / f"frame-00000{k}.color.png" for k in (1, 3))
    cut.write_bytes(cut.read_bytes()[:200])
    write_color(other, np.zeros((60, 80, 3), np.uint8))
    recording = open_recording(tmp_path)
    for k in (3, 1, 1):
        with pytest.raises(InputError):
            recording.frame(k)
    (note,) = (note for note in recording.notes if "colour images" in note)
    assert note.startswith("2 colour images could not be used, the first because: The colour image")
    assert f"{cut.name} is truncated or damaged" in note


def test_a_recording_whose_depth_is_all_damaged_is_refused_with_the_first_reason(tmp_path):
    write_tum(tmp_path / "recording", orbit(3))
    images = sorted((tmp_path / "recording" / "depth").iterdir())
    for image in images:
        image.write_bytes(image.read_bytes()[:40])
    with pytest.raises(InputError, match=images[0].name):
        open_recording(tmp_path / "recording")
