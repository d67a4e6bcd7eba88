"""Keyframes for other programs: pycolmap reads the model, and the import reads both forms back."""

import errno
import json
import os
import shutil
from dataclasses import dataclass, replace
from types import SimpleNamespace

import cv2
import numpy as np
import pycolmap
import pytest

from packetmesh.errors import InputError
from packetmesh.progress import drain
from pipeline.folders import keyframes
from pipeline.folders.keyframes import iterate_keyframes, straight
from pipeline.folders.run import clear_run_folder
from pipeline.importing import iterate_import
from pipeline.importing.upright import upright
from pipeline.io.rigs import load_rig
from pipeline.kernels.geometry import apply, inverse, pixel_rays
from pipeline.types import DepthMap, PointCloud, RgbdFrame
from tests.pipeline.lenses import KIND, by_opencv, camera
from tests.pipeline.strangers.room import room

NORMAL, OFFSET_M = np.array([0.28, -0.2, 0.9390]), 1.6


@dataclass(frozen=True)
class Frames:
    """A recording of frames that are in memory; those of ``damaged`` cannot be read."""

    frames: tuple[RgbdFrame, ...]
    damaged: tuple[int, ...] = ()
    name: str = "room"

    def frame(self, number):
        if number in self.damaged:
            raise InputError(f"image {number} is damaged; try another")
        return replace(self.frames[number], name=f"frame_{number:05d}")


def cloud_of(frame):
    """Points that a frame measured, in the world frame."""
    own_m = (pixel_rays(frame.intrinsics) * frame.depth.z_m[..., None])[::4, ::4].reshape(-1, 3)
    known = np.isfinite(own_m).all(axis=1)
    return PointCloud(apply(frame.T_world_camera, own_m[known]), frame.rgb[::4, ::4].reshape(-1, 3)[known])


def written(tmp_path, damaged=()):
    """Write two of three frames as keyframes, whose poses are not those of the recording."""
    frames = room(3).frames
    turn = np.eye(4)
    turn[:3, :3] = cv2.Rodrigues(np.array([0.0, 0.0, 0.4]))[0]
    poses = tuple(turn @ frame.T_world_camera for frame in frames)
    cloud = cloud_of(replace(frames[0], T_world_camera=poses[0]))
    walk = SimpleNamespace(T_world_camera=poses, keyframes=(0, 2), map=cloud)
    return drain(iterate_keyframes(Frames(frames, damaged), walk, tmp_path / "run")), walk


def test_pycolmap_reads_the_model_and_projects_its_points_to_their_pixels(tmp_path):
    folder, walk = written(tmp_path)
    model = pycolmap.Reconstruction(str(folder / "sparse"))
    assert {image.name for image in model.images.values()} == {"frame_00000.jpg", "frame_00002.jpg"}
    assert model.num_points3D() == len(walk.map)
    for image, number in zip(sorted(model.images.values(), key=lambda own: own.name), (0, 2), strict=True):
        T = np.vstack([image.cam_from_world().matrix(), [0.0, 0.0, 0.0, 1.0]])
        np.testing.assert_allclose(np.linalg.inv(T), walk.T_world_camera[number], atol=1e-9)
        seen = [own for own in image.points2D if own.has_point3D()]
        assert len(seen) > (600 if number == 0 else 50)
        for own in seen[::50]:
            point = model.points3D[own.point3D_id]
            assert np.abs(image.project_point(point.xyz) - own.xy).max() < 0.01
            assert (folder / "images" / image.name).is_file()


def test_a_point_behind_another_surface_is_not_seen(tmp_path):
    """Every feature's point has the depth that its keyframe measured."""
    folder, walk = written(tmp_path)
    model = pycolmap.Reconstruction(str(folder / "sparse"))
    last = next(image for image in model.images.values() if image.name == "frame_00002.jpg")
    frame = room(3).frames[2]
    for own in last.points2D:
        xyz = model.points3D[own.point3D_id].xyz
        z_m = (inverse(walk.T_world_camera[2]) @ [*xyz, 1.0])[2]
        column, row = np.floor(own.xy).astype(int)
        assert abs(frame.depth.z_m[row, column] - z_m) <= 0.021 * z_m
    assert len(last.points2D) < len(walk.map)


@pytest.mark.parametrize("without", ["sparse", "transforms.json"])
def test_the_import_reads_the_keyframes_back(tmp_path, without):
    folder, walk = written(tmp_path)
    gone = folder / without
    shutil.rmtree(gone) if gone.is_dir() else gone.unlink()
    report = drain(iterate_import(folder, tmp_path / "rig"))
    assert report.kind == ("nerfstudio" if without == "sparse" else "COLMAP")
    within = 1e-9 if without == "sparse" else 0.01
    turn = upright([walk.T_world_camera[k] for k in (0, 2)])
    for frame, number in zip(load_rig(tmp_path / "rig").frames, (0, 2), strict=True):
        expected = walk.T_world_camera[number] if turn is None else turn @ walk.T_world_camera[number]
        np.testing.assert_allclose(frame.T_world_camera, expected, atol=within)
        np.testing.assert_allclose(frame.intrinsics.matrix, room(3).frames[number].intrinsics.matrix)
        own, true = frame.depth.z_m, room(3).frames[number].depth.z_m
        np.testing.assert_allclose(own, true, atol=1e-3 if without == "sparse" else 0.03)


@pytest.mark.parametrize("kind", KIND)
def test_images_are_straight(kind):
    """A tilted wall: depth in the pinhole camera is that of its rays, and a point is where it projects."""
    own = camera(kind)
    z_m = (OFFSET_M / (pixel_rays(own) @ NORMAL)).astype(np.float32)
    rgb = np.zeros((240, 320, 3), np.uint8)
    point_m = np.array([[-0.2, 0.15, 1.5]])
    (column, row) = np.rint(by_opencv(own, point_m)[0]).astype(int)
    rgb[row - 2 : row + 3, column - 2 : column + 3] = 255
    frame = straight(RgbdFrame("one", rgb, DepthMap(z_m), own, np.eye(4)))
    view = frame.intrinsics
    assert not view.fisheye
    assert not np.any(view.distortion)
    expected = OFFSET_M / (pixel_rays(view) @ NORMAL)
    known = frame.depth.valid & (expected > 0.0) & (expected < 4.0)
    assert known.mean() > 0.4
    np.testing.assert_allclose(frame.depth.z_m[known], expected[known], rtol=0.02)
    assert abs(np.median(frame.depth.z_m[known] / expected[known]) - 1.0) < 1e-3
    u, v, w = view.matrix @ point_m[0]
    bright = np.argwhere(frame.rgb[..., 0] > 128).mean(axis=0)
    np.testing.assert_allclose(bright, [v / w, u / w], atol=1.0)


def test_a_keyframe_that_cannot_be_read_is_left_out(tmp_path):
    folder, _ = written(tmp_path, damaged=(0,))
    frames = json.loads((folder / "transforms.json").read_text())["frames"]
    assert [own["file_path"] for own in frames] == ["images/frame_00002.jpg"]


def test_nothing_remains_of_keyframes_that_do_not_fit_on_the_disk(tmp_path, monkeypatch):
    def full(*_):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(keyframes, "_write_model", full)
    with pytest.raises(InputError, match=r"keyframes cannot be written .*delete something there"):
        written(tmp_path)
    assert not list((tmp_path / "run").iterdir())


def test_keyframes_of_an_earlier_run_are_deleted(tmp_path):
    folder, _ = written(tmp_path)
    (tmp_path / "run" / ".keyframes-0123abcd" / "images").mkdir(parents=True)  # of a killed process
    (folder / "images" / "frame_00099.jpg").write_bytes(b"old")
    written(tmp_path)
    assert not (folder / "images" / "frame_00099.jpg").exists()
    assert [path.name for path in (tmp_path / "run").iterdir()] == ["keyframes"]
    (tmp_path / "run" / "notes.txt").write_text("mine")
    clear_run_folder(tmp_path / "run")
    assert [path.name for path in (tmp_path / "run").iterdir()] == ["notes.txt"]
