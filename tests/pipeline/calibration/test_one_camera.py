"""Series of names that fit much better alone are of several cameras."""

from dataclasses import replace
from pathlib import Path

import pytest

from packetmesh.errors import InputError
from pipeline.calibration.estimate import calibrate
from pipeline.calibration.one_camera import check_series_agree
from tests.pipeline.calibration.test_trust import SIZE, views


def series(moved_px=0.0, names=("front_{}", "back_{}")):
    """Views of one camera, or of two whose principal points are some pixels apart; paths by their names."""
    given = []
    for index, view in enumerate(views(0.05, 0, 12)):
        name = names[index % 2].format(index // 2)
        given.append(replace(view, name=name, points_px=view.points_px + moved_px * (index % 2)))
    return given, {view.name: Path(f"{view.name}.png") for view in given}


def test_two_cameras_are_refused():
    given, paths = series(12.0)
    with pytest.raises(InputError, match="2 cameras or focal lengths: 6 of 'back' and 6 of 'front'") as told:
        check_series_agree(calibrate(given, SIZE), given, paths)
    assert "add --one-camera" in str(told.value)


def test_two_series_of_one_camera_are_not():
    given, paths = series()
    check_series_agree(calibrate(given, SIZE), given, paths)


def test_names_that_tell_no_series_are_not():
    given, paths = series(12.0, ("view_{}", "wall_1{}"))
    check_series_agree(calibrate(given, SIZE), given, paths)
