"""Two real Kinect v1 frames, with what is published about them."""

import numpy as np
import pytest

from pipeline.io.depth_scale import doubts
from pipeline.io.rigs import load_frame, load_rig, save_rig
from pipeline.types import RgbdFrame, Rig


def frame(shared_data, name) -> RgbdFrame:
    folder = shared_data / name
    if not folder.is_dir():
        pytest.skip(f"no {name} in {shared_data}")
    return load_frame(folder / "color.png", folder / "depth.png", folder / "intrinsics.json", name=name)


@pytest.mark.parametrize("name", ["kinect_basket", "kinect_desk"])
@pytest.mark.parametrize(
    ("factor", "says"),
    [(1, None), (5, "scale 5000"), (8, "scale 8000"), (20, "scale 10000"), (0.02, "unlikely for a room")],
)
def test_a_wrong_scale_of_a_real_frame_is_doubted_and_the_right_one_is_not(shared_data, name, factor, says):
    depth = frame(shared_data, name).depth
    values = np.rint(np.where(depth.valid, 1000.0 * factor * depth.z_m, 0.0)).astype(np.int32)
    notes = doubts(values, 1000.0, stated=False)
    assert notes == () if says is None else says in notes[0]


@pytest.mark.parametrize(
    ("name", "coverage", "median_m", "focal_px", "distorted"),
    [
        ("kinect_basket", 0.80957, (0.5, 3.0), (529.74137, 529.57155), True),
        ("kinect_desk", 0.80811, (0.5, 3.0), (525.0, 525.0), False),
    ],
)
def test_a_kinect_frame_loads_as_published(shared_data, name, coverage, median_m, focal_px, distorted):
    loaded = frame(shared_data, name)
    camera = loaded.intrinsics
    assert loaded.rgb.shape == (480, 640, 3)
    assert loaded.rgb.std(axis=(0, 1)).min() > 10
    assert loaded.depth.coverage == pytest.approx(coverage, abs=1e-5)
    assert median_m[0] < np.nanmedian(loaded.depth.z_m) < median_m[1]
    assert (camera.fx_px, camera.fy_px) == focal_px
    assert (camera.width_px, camera.height_px) == (640, 480)
    assert bool(np.any(camera.distortion)) is distorted


def test_real_frames_survive_a_rig_folder_to_the_last_bit(shared_data, tmp_path):
    frames = tuple(frame(shared_data, name) for name in ("kinect_basket", "kinect_desk"))
    save_rig(tmp_path / "rig", Rig("rig", frames))
    again = load_rig(tmp_path / "rig")
    for before, after in zip(frames, again.frames, strict=True):
        np.testing.assert_array_equal(after.rgb, before.rgb)
        np.testing.assert_array_equal(after.depth.z_m, before.depth.z_m)
        np.testing.assert_array_equal(after.intrinsics.matrix, before.intrinsics.matrix)
        np.testing.assert_array_equal(after.intrinsics.distortion, before.intrinsics.distortion)
        np.testing.assert_array_equal(after.T_world_camera, before.T_world_camera)
