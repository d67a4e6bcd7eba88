"""Image topics of other drivers: brightness of 16 bits, depth as plain PNG, one camera in two sizes."""

import cv2
import numpy as np
import pytest

from packetmesh.errors import InputError
from packetmesh.progress import drain
from pipeline.importing import iterate_import
from pipeline.io.rigs import load_rig
from pipeline.kernels.geometry import rigid
from tests.pipeline.importing.bag_parts import Images, Info, K, colors, wall, write_parts
from tests.pipeline.importing.bags import BagWriter, link

COLOR = {"/cam/color/image_raw": Images(colors(3))}
MOVED = rigid(np.eye(3), np.array([0.5, 0.0, 0.0]))
INFO = {"/cam/color/camera_info": Info(k=K)}


def imported(tmp_path, images, infos=INFO, **options):
    bag = write_parts(tmp_path / "bag.bag", images, infos)
    report = drain(iterate_import(bag, tmp_path / "rig", **options))
    return report, load_rig(tmp_path / "rig").frames


@pytest.mark.parametrize(
    "topic", ["/cam/amplitude/image_raw", "/cam/confidence_image", "/cam/ir/image_raw", "/cam/a/image_ir"]
)
def test_brightness_of_16_bits_is_not_depth(tmp_path, topic):
    bright = Images(wall(3, z_mm=900))
    report, frames = imported(tmp_path, COLOR | {topic: bright, "/cam/depth/image_raw": Images(wall(3))})
    assert np.nanmedian(frames[0].depth.z_m) == pytest.approx(2.0, abs=0.01)
    assert any(f"{topic} is left out: by its name" in note for note in report.notes)
    with pytest.raises(InputError, match="has no depth images but /cam/color/image_raw"):
        drain(
            iterate_import(write_parts(tmp_path / "ir.bag", COLOR | {topic: bright}, INFO), tmp_path / "no")
        )


def test_a_topic_of_depth_may_have_brightness_in_its_name(tmp_path):
    report, frames = imported(tmp_path, COLOR | {"/ir/depth_image": Images(wall(3))})
    assert len(frames) == 3
    assert not any("brightness" in note for note in report.notes)


@pytest.mark.parametrize("format", ["16UC1; png compressed ", "png"])
def test_depth_may_be_a_plain_png_of_16_bits(tmp_path, format):
    """As image_transport's ordinary plugin compresses it."""
    path, depth_mm = tmp_path / "bag.bag", wall(1)[0]
    depth_mm[:10] = 0
    bag = BagWriter(path, "ros1")
    with bag.writer:
        bag.write("/cam/color/camera_info", Info(k=K).message(bag, 100.0), 100.0)
        bag.write("/cam/color/image_raw", Images(colors(1)).message(bag, 100.0, 0), 100.0)
        png = cv2.imencode(".png", depth_mm)[1].reshape(-1)
        message = bag.make("sensor_msgs/msg/CompressedImage", bag.header("optical", 100.0), format, png)
        bag.write("/cam/depth/image_raw/compressed", message, 100.0)
    drain(iterate_import(path, tmp_path / "rig"))
    (frame,) = load_rig(tmp_path / "rig").frames
    expected = np.where(depth_mm > 0, depth_mm / 1000.0, np.nan)
    np.testing.assert_allclose(frame.depth.z_m, expected, atol=1e-6)


def test_one_camera_in_two_sizes_is_one_node(tmp_path):
    """As kinect2_bridge publishes hd and qhd."""
    half = K * 0.5
    half[:2, 2], half[2, 2] = (K[:2, 2] + 0.5) / 2 - 0.5, 1.0
    images = {
        "/k/hd/image_color": Images(colors(3)),
        "/k/hd/image_depth": Images(wall(3)),
        "/k/qhd/image_color": Images(colors(3, (80, 60))),
        "/k/qhd/image_depth": Images(wall(3, (80, 60))),
    }
    infos = {"/k/hd/camera_info": Info(k=K), "/k/qhd/camera_info": Info(k=half, size=(80, 60))}
    report, frames = imported(tmp_path, images, infos)
    assert {frame.rgb.shape for frame in frames} == {(120, 160, 3)}
    assert any(
        "/k/qhd/image_color is left out: it shows the same as /k/hd/image_color" in n for n in report.notes
    )


def test_larger_depth_in_the_colour_image_s_frame_is_said_to_be_resized(tmp_path):
    report, _ = imported(tmp_path, COLOR | {"/cam/depth/image_raw": Images(wall(3, (320, 240)))})
    assert any(
        "Depth has 320 x 240 pixels and colour 160 x 120: taken as the same view" in n for n in report.notes
    )


def write_two_cameras(path, frames):
    """Two cameras with static transforms to the frames of their images."""
    bag = BagWriter(path, "ros1")
    with bag.writer:
        links = [link(bag, "map", frame, T) for frame, T in zip(frames, (np.eye(4), MOVED), strict=True)]
        bag.write("/tf_static", bag.make("tf2_msgs/msg/TFMessage", links), 100.0)
        for k, frame in enumerate(frames):
            info = Info(k=K, frame=frame).message(bag, 100.0)
            bag.write(f"/cam{k}/color/camera_info", info, 100.0)
            for name, values in (("color", colors(1)), ("depth", wall(1))):
                image = Images(values, frame).message(bag, 100.0, 0)
                bag.write(f"/cam{k}/{name}/image_raw", image, 100.0)


def test_cameras_take_the_moment_nearest_to_the_middle_in_which_both_have_depth(tmp_path):
    """The middle is that of three moments, in which the second camera has none; it records metres."""
    metres = (wall(3) / 1000.0).astype(np.float32)
    metres[1] = np.nan
    images = {
        f"/cam{k}/{name}": Images(values, f"optical{k}")
        for k, depth in enumerate((wall(3), metres))
        for name, values in (("color", colors(3)), ("depth", depth))
    }
    infos = {f"/cam{k}/camera_info": Info(k=K, frame=f"optical{k}") for k in range(2)}
    report, frames = imported(tmp_path, images, infos)
    assert [float(np.median(frame.depth.z_m)) for frame in frames] == pytest.approx([2.002, 2.002])
    assert "1 moment with a depth image without any depth was left out" in report.notes
    assert report.depth_scale is None
    assert any(note.startswith("Depth: 1 or 1000 units in a metre") for note in report.notes)


def test_cameras_of_one_frame_do_not_get_one_pose(tmp_path):
    """Two drivers that were started with the same name of the frame."""
    write_two_cameras(tmp_path / "bag.bag", ("left", "right"))
    drain(iterate_import(tmp_path / "bag.bag", tmp_path / "apart"))
    first, second = load_rig(tmp_path / "apart").frames
    np.testing.assert_allclose(np.linalg.inv(first.T_world_camera) @ second.T_world_camera, MOVED, atol=1e-12)
    write_two_cameras(tmp_path / "same.bag", ("optical", "optical"))
    report = drain(iterate_import(tmp_path / "same.bag", tmp_path / "rig"))
    assert [frame.pose_known for frame in load_rig(tmp_path / "rig").frames] == [False, False]
    assert any("Several cameras have the frame optical, so that transforms do not" in n for n in report.notes)
