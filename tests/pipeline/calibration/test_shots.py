"""Images of a session are found by camera and moment, whatever they are called."""

import json

import pytest

from packetmesh.errors import InputError
from pipeline.calibration.board import Board
from pipeline.calibration.from_images import image_files
from pipeline.calibration.shots import board_beside, node_shots


def touch(folder, *names):
    folder.mkdir(parents=True, exist_ok=True)
    for name in names:
        (folder / name).touch()
    return folder


def test_nodes_of_a_session_with_depth_and_infrared(tmp_path):
    touch(
        tmp_path / "node_00", "color_00.png", "depth_00.png", "infrared_00.png", "color_01.jpg", "notes.txt"
    )
    touch(tmp_path / "node_01", "color_01.png", "color_02.png", "depth_02.png")
    first, second = node_shots([tmp_path])
    assert (first.name, second.name) == ("node_00", "node_01")
    assert [(shot.moment, shot.color.name) for shot in first.shots] == [
        ("0", "color_00.png"),
        ("1", "color_01.jpg"),
    ]
    assert first.shots[0].depth.name == "depth_00.png"
    assert first.shots[0].infrared.name == "infrared_00.png"
    assert first.shots[1].depth is None
    assert [shot.moment for shot in second.shots] == ["1", "2"]
    assert second.shots[1].depth.name == "depth_02.png"


def test_folders_of_photographs_become_nodes_in_their_order_and_numbers_are_moments(tmp_path):
    left = touch(tmp_path / "left", "left01.jpg", "left02.jpg")
    right = touch(tmp_path / "right", "right_2.jpg", "right_0001.jpg", "IMG_20240101_7.jpg")
    nodes = node_shots([left, right])
    assert [node.name for node in nodes] == ["node_00", "node_01"]
    assert {shot.moment for shot in nodes[0].shots} == {"1", "2"}
    assert {shot.moment for shot in nodes[1].shots} == {"1", "2", "7"}


def test_names_without_numbers_are_moments_themselves(tmp_path):
    one, other = (touch(tmp_path / name, "tilted.png", "straight.png") for name in ("a", "b"))
    assert [shot.moment for shot in node_shots([one, other])[0].shots] == ["straight", "tilted"]


def test_some_nodes_of_a_session_keep_their_names(tmp_path):
    folders = [touch(tmp_path / name, "color_00.png") for name in ("node_00", "node_02")]
    assert [node.name for node in node_shots(folders)] == ["node_00", "node_02"]


def test_one_camera_takes_photographs_but_no_depth(tmp_path):
    touch(tmp_path, "color_00.png", "depth_00.png", "infrared_00.png", "color_01.png")
    assert [path.name for path in image_files([str(tmp_path)])] == ["color_00.png", "color_01.png"]


@pytest.mark.parametrize(
    ("names", "sentence"),
    [
        ((), "holds no image of a camera"),
        (("depth_00.png",), "holds no image of a camera"),
        (("color_01.png", "photo_1.png"), "are both of moment 1"),
    ],
)
def test_folders_that_are_no_cameras_say_so(tmp_path, names, sentence):
    touch(tmp_path / "node_00", *names)
    with pytest.raises(InputError, match=sentence):
        node_shots([tmp_path])


def test_too_many_folders_twice_the_same_or_none_say_so(tmp_path):
    folders = [touch(tmp_path / str(index), "color_00.png") for index in range(7)]
    with pytest.raises(InputError, match="7 folders of images are given"):
        node_shots(folders)
    with pytest.raises(InputError, match="given twice"):
        node_shots([folders[0], folders[0]])
    with pytest.raises(InputError, match="is no folder"):
        node_shots([tmp_path / "nowhere"])


def test_the_board_is_what_is_said_then_what_its_file_says_then_the_thesiss(tmp_path):
    node = touch(tmp_path / "node_00", "color_00.png")
    assert board_beside([node]) == Board()
    told = {"pattern": "chessboard", "columns": 9, "rows": 6, "spacing_mm": 25}
    (tmp_path / "board.json").write_text(json.dumps(told))
    for where in (node, tmp_path):
        assert board_beside([where]) == Board("chessboard", 9, 6, 0.025)
    assert board_beside([node], spacing_mm=30.0) == Board("chessboard", 9, 6, 0.03)
    (tmp_path / "board.json").write_text('{"pattern": "chessboard"}')
    with pytest.raises(InputError, match="lacks a valid pattern, columns, rows or spacing_mm"):
        board_beside([node])
