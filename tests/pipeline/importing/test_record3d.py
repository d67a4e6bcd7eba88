"""Record3D's .r3d: a ZIP of photographs with compressed depth and confidence."""

import re
import sys
import zipfile
from contextlib import suppress

import lzfse
import numpy as np
import pytest
from viser.extras import Record3dLoader

from packetmesh.errors import InputError
from packetmesh.progress import drain
from pipeline.importing import iterate_import
from pipeline.importing.recorded import open_recording
from pipeline.io.images import read_depth
from pipeline.io.rigs import load_rig
from tests.pipeline.importing.recordings import CAMERA, orbit
from tests.pipeline.strangers.containers import write_r3d


def changed(file, names, change):
    """Rewrite the ZIP: ``change`` returns the new bytes of the named files, or None to leave one out."""
    with zipfile.ZipFile(file) as archive:
        kept = {name: archive.read(name) for name in archive.namelist()}
    with zipfile.ZipFile(file, "w") as archive:
        for name, data in kept.items():
            new = change(data) if name in names else data
            if new is not None:
                archive.writestr(name, new)


def unpacked(file):
    with zipfile.ZipFile(file) as archive:
        archive.extractall(file.parent / "unpacked")
    return file.parent / "unpacked"


@pytest.mark.parametrize("folder", [False, True])
def test_the_frames_are_those_that_were_written(tmp_path, folder):
    written = orbit(4)
    file = write_r3d(tmp_path / "capture", written, fps=30)
    recording = open_recording(unpacked(file) if folder else file)
    assert recording.kind == ("Record3D" if folder else "Record3D .r3d")
    np.testing.assert_allclose(recording.times_s, np.arange(4) / 30.0)
    for k in (2, 0, 3, 1):
        expected, view, frame = written.frames[k], recording.view(k), recording.frame(k)
        np.testing.assert_array_equal(view.depth.z_m, expected.depth.z_m)
        np.testing.assert_allclose(view.camera.matrix, CAMERA.matrix, atol=1e-9)
        np.testing.assert_allclose(recording.T_world_camera[k], expected.T_world_camera, atol=1e-9)
        assert np.abs(frame.rgb[1::3, 1::3].astype(int) - expected.rgb).mean() < 25  # JPEG of noise
        assert frame.rgb.shape == (90, 120, 3)


def test_poses_and_depth_are_those_of_visers_loader(tmp_path, monkeypatch):
    """Another project's loader, which only reads depth of 192 x 256 pixels, reads the same file."""
    monkeypatch.setitem(sys.modules, "liblzfse", lzfse)
    written = orbit(2)
    big = [np.repeat(np.repeat(frame.depth.z_m, 5, axis=0), 5, axis=1)[:, :192] for frame in written.frames]
    tall = [np.concatenate([z_m, z_m])[:256] for z_m in big]
    file = write_r3d(tmp_path / "capture", written, times=1, dw=192, dh=256, w=192, h=256)
    for k, z_m in enumerate(tall):
        changed(file, [f"rgbd/{k}.depth"], lambda _, z_m=z_m: lzfse.compress(z_m.astype("<f4").tobytes()))
        changed(
            file, [f"rgbd/{k}.conf"], lambda _: lzfse.compress(np.full((256, 192), 2, np.uint8).tobytes())
        )
    loader = Record3dLoader(unpacked(file))
    recording = open_recording(file)
    for k in range(2):
        theirs = loader.get_frame(k)
        np.testing.assert_allclose(recording.T_world_camera[k][:3], theirs.T_world_camera, atol=1e-6)
        np.testing.assert_array_equal(recording.view(k).depth.z_m, theirs.depth)


def test_depth_of_low_confidence_is_left_out(tmp_path):
    levels = np.full((30, 40), 2, np.uint8)
    levels[:, :20], levels[:, 20:30] = 0, 1
    written = orbit(2)
    file = write_r3d(tmp_path / "capture", written, confidence=levels)
    report = drain(iterate_import(file, tmp_path / "rig"))
    known = np.isfinite(read_depth(tmp_path / "rig" / "node_01" / "depth.png").z_m)
    assert not known[:, :20].any()
    np.testing.assert_array_equal(known[:, 20:], written.frames[1].depth.valid[:, 20:])
    assert any("lowest confidence (0) is left out" in note for note in report.notes)


def test_every_frame_has_its_own_camera_in_the_photographs_pixels(tmp_path):
    """Coefficients for 240 x 180 pixels, next to photographs of 120 x 90."""
    own = [[180.0 + k, 183.0, 119.5, 89.5] for k in range(3)]
    matrix = [180.0, 0, 0, 0, 183.0, 0, 119.5, 89.5, 1]
    file = write_r3d(tmp_path / "capture", orbit(3), perFrameIntrinsicCoeffs=own, K=matrix, w=240, h=180)
    drain(iterate_import(file, tmp_path / "rig"))
    frames = load_rig(tmp_path / "rig").frames
    assert [frame.intrinsics.fx_px for frame in frames] == [90.0, 90.5, 91.0]
    assert (frames[0].intrinsics.cx_px, frames[0].intrinsics.cy_px) == pytest.approx((59.5, 44.5))


def test_times_are_those_of_the_frames(tmp_path):
    file = write_r3d(tmp_path / "capture", orbit(3), frameTimestamps=[0.0, 0.05, 0.2])
    np.testing.assert_allclose(open_recording(file).times_s, [0.0, 0.05, 0.2])


def test_depth_whose_size_is_not_stated_has_the_photographs_proportions(tmp_path):
    file = write_r3d(tmp_path / "capture", orbit(2), dw=None, dh=None)
    assert open_recording(file).view(1).depth.z_m.shape == (30, 40)


def test_uncompressed_depth_is_read(tmp_path):
    written = orbit(2)
    file = write_r3d(tmp_path / "capture", written)
    changed(file, ["rgbd/0.depth", "rgbd/1.depth"], lzfse.decompress)
    np.testing.assert_array_equal(open_recording(file).view(1).depth.z_m, written.frames[1].depth.z_m)


def test_names_may_have_leading_zeros(tmp_path):
    written = orbit(3)
    file = write_r3d(tmp_path / "capture", written)
    with zipfile.ZipFile(file) as archive:
        kept = {name: archive.read(name) for name in archive.namelist()}
    with zipfile.ZipFile(file, "w") as archive:
        for name, data in kept.items():
            archive.writestr(re.sub(r"rgbd/(\d)\.", r"rgbd/000\1.", name), data)
    recording = open_recording(file)
    np.testing.assert_array_equal(recording.view(2).depth.z_m, written.frames[2].depth.z_m)
    assert recording.frame(1).rgb.shape == (90, 120, 3)


def test_frames_without_an_image_are_left_out_and_the_others_keep_their_poses(tmp_path):
    written = orbit(4)
    file = write_r3d(tmp_path / "capture", written)
    changed(file, ["rgbd/1.jpg"], lambda _: None)
    recording = open_recording(file)
    assert any("1 of 4 frames" in note for note in recording.notes)
    for place, k in enumerate((0, 2, 3)):
        np.testing.assert_array_equal(recording.view(place).depth.z_m, written.frames[k].depth.z_m)
        expected = written.frames[k].T_world_camera
        np.testing.assert_allclose(recording.T_world_camera[place], expected, atol=1e-9)


@pytest.mark.parametrize(
    ("names", "change", "says"),
    [
        (["metadata"], lambda _: None, "has no metadata"),
        (["metadata"], lambda _: b'{"w": 1', "is not valid JSON"),
        (["metadata"], lambda _: b'{"w": 120, "h": 90}', "not in Record3D's format"),
        (["metadata"], lambda data: data.replace(b'"fps": 60', b'"fps": "x"'), "not in Record3D's format"),
        (["rgbd/0.jpg", "rgbd/1.jpg"], lambda _: None, "no frame with colour and depth"),
        (["rgbd/0.jpg"], lambda data: data[:90], "rgbd/0.jpg in .* is truncated or damaged"),
        (["rgbd/0.depth"], lambda data: data[:60], "rgbd/0.depth in .* is truncated or damaged"),
        (["rgbd/0.depth"], lambda _: b"\x04\x22\x4d\x18 something", "has an unknown compression"),
        (["rgbd/0.depth"], lambda _: lzfse.compress(bytes(16)), "rgbd/0.depth in .* is truncated or damaged"),
        (["metadata"], lambda data: data.replace(b'"dw": 40', b'"dw": -40'), "not in Record3D's format"),
    ],
)
def test_a_damaged_part_gets_a_sentence(tmp_path, names, change, says):
    file = write_r3d(tmp_path / "capture", orbit(2))
    changed(file, names, change)
    with pytest.raises(InputError, match=says) as error:
        drain(iterate_import(file, tmp_path / "rig"))
    assert "room.r3d" in str(error.value)
    assert not (tmp_path / "rig").exists()


def test_a_cut_file_gets_a_sentence(tmp_path):
    file = write_r3d(tmp_path / "capture", orbit(2))
    file.write_bytes(file.read_bytes()[:-40])
    with pytest.raises(InputError, match=r"room.r3d is no ZIP, .*; try to export it again"):
        open_recording(file)


def test_random_damage_of_depth_never_stops_the_program(tmp_path):
    rng = np.random.default_rng(5)
    file = write_r3d(tmp_path / "capture", orbit(1))
    with zipfile.ZipFile(file) as archive:
        data = archive.read("rgbd/0.depth")
    for number in range(30):
        wrong = np.frombuffer(data, np.uint8).copy()
        wrong[rng.integers(3, len(wrong), 4)] = rng.integers(256, size=4)
        changed(file, ["rgbd/0.depth"], lambda _, wrong=wrong: wrong.tobytes())
        with suppress(InputError):
            drain(iterate_import(file, tmp_path / f"rig_{number}"))
