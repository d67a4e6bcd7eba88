"""Images of several cameras in one folder are noticed, and those of one camera are not taken for several."""

import re
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from packetmesh.errors import InputError
from pipeline.calibration.from_images import image_files
from pipeline.calibration.series import camera_series, check_one_camera, made_by, same_moments
from pipeline.calibration.shots import series_shots


def named(*patterns, count=3):
    return [Path(pattern.format(index)) for index in range(count) for pattern in patterns]


@pytest.mark.parametrize(
    ("patterns", "cameras"),
    [
        (("left-{:04d}.jpg", "right-{:04d}.jpg"), ["left", "right"]),
        (("Left{:02d}.png", "Right{:02d}.png"), ["left", "right"]),
        (("leftImage{}.png", "rightImage{}.png"), ["left", "right"]),
        (("{:04d}_left.png", "{:04d}_right.png"), ["left", "right"]),
        (("L_{}.png", "R_{}.png"), ["l", "r"]),
        (("imgL{}.png", "imgR{}.png"), ["l", "r"]),
        (("cam0_{:03d}.png", "cam1_{:03d}.png"), ["cam0", "cam1"]),
        (("camera_1-{}.png", "camera_2-{}.png", "camera_3-{}.png"), ["camera_1", "camera_2", "camera_3"]),
        (("{:03d}_camA.png", "{:03d}_camB.png"), ["cama", "camb"]),
        (("rgb_{}.png", "ir_{}.png"), ["ir", "rgb"]),
    ],
)
def test_names_tell_the_cameras_and_the_moments(patterns, cameras):
    files = named(*patterns)
    series = camera_series(files)
    assert list(series) == cameras
    assert sum(map(len, series.values())) == len(files)
    nodes = series_shots(files)
    assert [node.name for node in nodes] == [f"node_{index:02d}" for index in range(len(cameras))]
    assert all([shot.moment for shot in node.shots] == ["0", "1", "2"] for node in nodes)


@pytest.mark.parametrize(
    "patterns",
    [
        ("view{}.png", "wall.png"),
        ("IMG_{:04d}.jpg",),
        ("left{:02d}.jpg",),
        ("cam0_{}.png",),
        ("camera{}.png",),
        ("IMG_20240101_12000{}.jpg", "IMG_20240102_12000{}.jpg"),
        ("tilted{}.png", "straight{}.png"),
        ("rearranged_{}.png", "clear_{}.png"),
        ("DSC_{:04d}.JPG", "DSC_1{:03d}.JPG"),
    ],
)
def test_names_of_one_camera_are_left_alone(patterns):
    files = named(*patterns)
    assert camera_series(files) == {}
    check_one_camera(files)


@pytest.mark.parametrize(
    ("patterns", "alone"),
    [
        (("left-{:04d}.jpg", "right-{:04d}.jpg"), "left*.jpg"),
        (("{:04d}_left.png", "{:04d}_right.png"), "*_left.png"),
        (("1{:03d}_camA.png", "1{:03d}_camB.png"), "*_camA.png"),
    ],
)
def test_the_pattern_of_one_camera_keeps_what_its_names_end_with(patterns, alone):
    with pytest.raises(InputError, match=re.escape(f'alone by "{alone}"')):
        check_one_camera(named(*patterns))


def test_each_remedy_of_the_refusal_works(tmp_path):
    for path in named("left-{:04d}.jpg", "right-{:04d}.jpg"):
        Image.new("L", (8, 6)).save(tmp_path / path)
    with pytest.raises(InputError, match="3 of 'left' and 3 of 'right'") as refused:
        image_files([str(tmp_path)])
    told = str(refused.value)
    pattern = re.search(r'alone by "([^"]+)"', told)[1]
    assert [path.name for path in image_files([str(tmp_path / pattern)])] == [
        f"left-000{k}.jpg" for k in range(3)
    ]
    assert "--one-camera" in told
    assert len(image_files([str(tmp_path)], one_camera=True)) == 6
    assert "--rig" in told
    assert len(series_shots(image_files([str(tmp_path)], one_camera=True))) == 2
    assert "a folder of its own" in told
    (tmp_path / "left").mkdir()
    for path in tmp_path.glob("left-*"):
        path.rename(tmp_path / "left" / path.name)
    assert len(image_files([str(tmp_path / "left")])) == 3


def test_names_that_tell_no_cameras_apart_make_no_rig():
    with pytest.raises(InputError, match=r"do not tell cameras apart; name them as left-0000\.png"):
        series_shots(named("view{}.png"))
    with pytest.raises(InputError, match="7 cameras, and a rig has at most 6"):
        series_shots(named(*(f"cam{k}_{{}}.png" for k in range(7))))


def photograph(path, model="", focal_mm=None, serial=""):
    exif = Image.Exif()
    if model:
        exif[0x0110] = model
    detail = exif.get_ifd(0x8769)
    if focal_mm is not None:
        detail[0x920A] = focal_mm
    if serial:
        detail[0xA431] = serial
    Image.fromarray(np.zeros((6, 8), np.uint8)).save(path, exif=exif)


def test_exif_data_of_two_cameras_two_bodies_or_two_focal_lengths_are_noticed(tmp_path):
    for kinds in (
        ({"model": "X100"}, {"model": "EOS R"}),
        ({"model": "X100", "serial": "1"}, {"model": "X100", "serial": "2"}),
        ({"model": "Phone", "focal_mm": 4.2}, {"model": "Phone", "focal_mm": 1.8}),
    ):
        files = [tmp_path / f"{index}.jpg" for index in range(4)]
        for index, path in enumerate(files):
            photograph(path, **kinds[index % 2])
        with pytest.raises(
            InputError, match=r"2 cameras or focal lengths by their EXIF data: 0\.jpg of .*--one-camera"
        ):
            check_one_camera(files)
        check_one_camera(files[::2])


def test_images_without_exif_data_or_no_images_are_left_to_their_reader(tmp_path):
    photograph(tmp_path / "a.jpg", "X100")
    Image.new("L", (8, 6)).save(tmp_path / "b.png")
    (tmp_path / "c.png").write_bytes(b"no image")
    check_one_camera([tmp_path / name for name in ("a.jpg", "b.png", "c.png", "missing.png")])
    assert made_by(tmp_path / "c.png") == ""


@pytest.mark.parametrize(
    ("patterns", "cameras"),
    [
        (("front_{}.png", "back_{}.png"), ["back", "front"]),
        (("A{:02d}.png", "B{:02d}.png"), ["a", "b"]),
        (("{:04d}_0.png", "{:04d}_1.png"), ["0", "1"]),
        (("img_0_{}.png", "img_1_{}.png", "img_2_{}.png"), ["0", "1", "2"]),
        (("{:04d}-Süd.png", "{:04d}-Nord.png"), ["nord", "süd"]),
    ],
)
def test_names_with_the_same_moments_may_be_of_several_cameras_and_are_a_rig(patterns, cameras):
    files = named(*patterns, count=5)
    assert camera_series(files) == {}
    assert list(same_moments(files)) == cameras
    nodes = series_shots(files)
    assert len(nodes) == len(cameras)
    assert all([shot.moment for shot in node.shots] == ["0", "1", "2", "3", "4"] for node in nodes)


@pytest.mark.parametrize(
    "patterns",
    [("IMG_{:04d}.jpg",), ("view{}.png", "wall.png"), ("a{}.png", "b1{}.png"), ("2024-01-0{}_12-3{}.png",)],
)
def test_other_names_have_no_moments_in_common(patterns):
    files = [Path(pattern.format(index, index)) for index in range(5) for pattern in patterns]
    assert same_moments(files) == {}


def test_an_image_that_tells_no_camera_is_not_silently_left_out_of_a_rig():
    files = [*named("left{}.png", "right{}.png"), Path("extra.png")]
    with pytest.raises(InputError, match=r"The name of extra\.png does not tell its camera"):
        series_shots(files)


def test_time_stamps_with_a_fraction_are_moments():
    stamps = ("1700000000.250", "1700000001.250", "1700000001.750")
    left, right = series_shots(
        [Path(f"{side}-{stamp}.png") for stamp in stamps for side in ("left", "right")]
    )
    assert [shot.color.name for shot in left.shots] == [f"left-{stamp}.png" for stamp in stamps]
    assert [shot.moment for shot in left.shots] == [shot.moment for shot in right.shots]
    assert len({shot.moment for shot in left.shots}) == 3
