"""A folder without images is refused with what is in it, and the remedy works."""

import cv2
import numpy as np
import pytest

from packetmesh.errors import InputError
from pipeline.calibration.from_images import image_files


def picture(path):
    path.parent.mkdir(exist_ok=True)
    cv2.imwrite(str(path), np.zeros((4, 6), np.uint8))
    return path


def refusal(folder):
    with pytest.raises(InputError) as refused:
        image_files([str(folder)])
    return str(refused.value)


def test_sub_folders_are_named_and_can_be_given(tmp_path):
    inside = picture(tmp_path / "raw" / "a.png")
    told = refusal(tmp_path)
    assert told.endswith(f"give {inside.parent}")
    assert image_files([told.rsplit("give ")[1]]) == [inside]
    picture(tmp_path / "other" / "a.png")
    assert refusal(tmp_path).endswith(f"give those of the cameras: {tmp_path / 'other'} {tmp_path / 'raw'}")


@pytest.mark.parametrize("ending", [".mp4", ".MOV"])
def test_a_video_is_told_with_the_command_that_makes_images(tmp_path, ending):
    video = tmp_path / f"calib{ending}"
    video.write_bytes(b"0")
    for given in (tmp_path, video):
        assert f"calib{ending} is a video" in refusal(given)
        assert f"ffmpeg -i {video}" in refusal(given)


def test_other_formats_are_named(tmp_path):
    for index in range(3):
        (tmp_path / f"{index}.bmp").write_bytes(b"BM")
    assert "holds 3 files .bmp; convert images to PNG" in refusal(tmp_path)


def test_tiff_files_are_images_and_hidden_files_are_not(tmp_path):
    wanted = [picture(tmp_path / "a.tif"), picture(tmp_path / "b.TIFF")]
    (tmp_path / "._a.tif").write_bytes(b"no image")
    (tmp_path / ".DS_Store").write_bytes(b"no image")
    assert image_files([str(tmp_path)]) == wanted
