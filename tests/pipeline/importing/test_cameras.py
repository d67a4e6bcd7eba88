"""Of several camera files next to a recording, that of the colour camera is read, or none."""

import json

import pytest

from packetmesh.errors import InputError
from packetmesh.progress import drain
from pipeline.importing import iterate_import
from pipeline.io.rigs import load_rig
from tests.pipeline.importing.recordings import orbit, write_redwood

COLOR = {"width": 40, "height": 30, "fx": 30.0, "fy": 30.5, "cx": 19.5, "cy": 14.5}
DEPTH = COLOR | {"fx": 25.0}
SMALL_DEPTH = DEPTH | {"width": 20, "height": 15, "cx": 9.5, "cy": 7.0}


def recording(tmp_path, files):
    write_redwood(tmp_path / "recording", orbit(2))
    (tmp_path / "recording" / "camera_intrinsic.json").unlink()
    for name, values in files.items():
        file = tmp_path / "recording" / name
        file.parent.mkdir(exist_ok=True)
        if file.suffix == ".txt":
            file.write_text(f"{values['fx']} 0 {values['cx']}\n0 {values['fy']} {values['cy']}\n0 0 1\n")
        else:
            file.write_text(json.dumps(values))


def focal_length(tmp_path, **options):
    drain(iterate_import(tmp_path / "recording", tmp_path / "rig", **options))
    return load_rig(tmp_path / "rig").frames[0].intrinsics.fx_px


@pytest.mark.parametrize(
    "files",
    [
        {"depth_intrinsics.json": DEPTH, "rgb_intrinsics.json": COLOR},
        {"IR.json": DEPTH, "color.json": COLOR},
        {"depth_intrinsics.txt": DEPTH, "intrinsics.txt": COLOR},
        {"intrinsics_depth.yaml": DEPTH, "third.json": COLOR},
        {"calib/1.yaml": COLOR, "calib/2.yaml": COLOR},
        {"depth_intrinsics.json": SMALL_DEPTH, "intrinsics_color.txt": COLOR},
        {"depth_intrinsics.json": SMALL_DEPTH, "../intrinsics.txt": COLOR},
        {"depth_intrinsics.txt": DEPTH, "../intrinsics.txt": COLOR},
        {"small.json": SMALL_DEPTH, "intrinsics.txt": COLOR},
    ],
)
def test_the_depth_camera_is_not_taken_for_the_colour_camera(tmp_path, files):
    recording(tmp_path, files)
    assert focal_length(tmp_path) == 30.0


def test_a_camera_of_another_size_next_to_the_images_is_not_replaced_by_one_above(tmp_path):
    """A bare matrix in the folder above has no size, and may be of another recording."""
    recording(tmp_path, {"camera.json": SMALL_DEPTH, "../intrinsics.txt": COLOR})
    with pytest.raises(InputError, match=r"camera.json is for 20 x 15 pixels but .* has 40 x 30"):
        focal_length(tmp_path)


def test_a_choice_between_two_cameras_is_the_user_s(tmp_path):
    recording(tmp_path, {"left.json": COLOR, "right.json": DEPTH})
    with pytest.raises(
        InputError, match=r"different cameras .* in left.json, right.json; try --intrinsics FILE"
    ):
        focal_length(tmp_path)
    assert focal_length(tmp_path, intrinsics=tmp_path / "recording" / "right.json") == 25.0
