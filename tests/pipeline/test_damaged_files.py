"""Files that stop in the middle are refused by name, and the remedy, another copy, opens."""

import cv2
import numpy as np
import pytest

from packetmesh.errors import InputError
from packetmesh.progress import drain
from pipeline.importing import iterate_import
from pipeline.io.clouds import read_cloud
from pipeline.io.images import read_color, read_depth
from pipeline.io.rigs import load_rig
from tests.pipeline.importing.recordings import orbit, write_tum
from tests.pipeline.strangers.room import room_cloud
from tests.pipeline.test_one_room import CLOUDS

pytestmark = pytest.mark.xdist_group("one room")
LINES = {".xyz", ".obj", ".csv", ".txt", ".asc"}
"""Formats in which the first lines of a file are a file."""
COUNTED = [kind for kind in CLOUDS if kind.suffix not in LINES]
KEPT = 0.6
"""Share of a file that is left of it; for a sweep it is no whole number of rows."""
RNG = np.random.default_rng(3)
COLOR = RNG.integers(0, 255, (30, 40, 3), np.uint8)
DEPTH_MM = RNG.integers(800, 3000, (30, 40)).astype(np.uint16)


def cut(path):
    """Cut a file; returns its bytes."""
    whole = path.read_bytes()
    path.write_bytes(whole[: int(KEPT * len(whole)) | 1])
    return whole


@pytest.mark.parametrize("kind", COUNTED, ids=lambda kind: kind.name)
def test_a_cloud_that_was_cut_opens_as_another_copy(tmp_path, kind):
    path = tmp_path / f"room{kind.suffix}"
    kind.write(path, room_cloud())
    whole = cut(path)
    with pytest.raises(InputError, match=r"room.*(copy|export|save)"):
        read_cloud(path)
    path.write_bytes(whole)
    assert len(read_cloud(path)) == pytest.approx(len(room_cloud()), abs=3)  # STL has whole triangles


@pytest.mark.parametrize("suffix", ["png", "jpg", "tiff", "ppm"])
def test_a_photograph_that_was_cut_opens_as_another_copy(tmp_path, suffix):
    path = tmp_path / f"color.{suffix}"
    cv2.imwrite(str(path), COLOR)
    whole = cut(path)
    with pytest.raises(InputError, match=r"color.*copy"):
        read_color(path)
    path.write_bytes(whole)
    assert read_color(path).shape == COLOR.shape


@pytest.mark.parametrize("suffix", ["png", "tiff", "pgm", "npy"])
def test_a_depth_image_that_was_cut_opens_as_another_copy(tmp_path, suffix):
    path = tmp_path / f"depth.{suffix}"
    np.save(path, DEPTH_MM) if suffix == "npy" else cv2.imwrite(str(path), DEPTH_MM)
    whole = cut(path)
    with pytest.raises(InputError, match=r"depth.*copy"):
        read_depth(path)
    path.write_bytes(whole)
    assert np.array_equal(np.rint(1000.0 * read_depth(path).z_m), DEPTH_MM)


def test_a_folder_of_several_recordings_opens_as_one_that_is_named(tmp_path):
    for name in ("monday", "tuesday"):
        write_tum(tmp_path / "week" / name, orbit(2))
    with pytest.raises(InputError, match="2 recordings; try one of them: monday, tuesday"):
        drain(iterate_import(tmp_path / "week", tmp_path / "rig"))
    drain(iterate_import(tmp_path / "week" / "tuesday", tmp_path / "rig"))
    assert len(load_rig(tmp_path / "rig").frames) == 2


def test_lists_whose_clocks_differ_open_when_the_clocks_agree(tmp_path):
    write_tum(tmp_path / "recording", orbit(2))
    rgb = tmp_path / "recording" / "rgb.txt"
    right = rgb.read_text()
    lines = [line.split(" ", 1) for line in right.splitlines() if not line.startswith("#")]
    rgb.write_text("".join(f"{float(time_s) + 5000.0:.6f} {name}\n" for time_s, name in lines))
    with pytest.raises(
        InputError, match=r"4999\.992 s earlier; if the clocks differ, add this to the times in"
    ):
        drain(iterate_import(tmp_path / "recording", tmp_path / "rig"))
    depth = tmp_path / "recording" / "depth.txt"
    told = [line.split(" ", 1) for line in depth.read_text().splitlines() if not line.startswith("#")]
    depth.write_text("".join(f"{float(time_s) + 5000.0:.6f} {name}\n" for time_s, name in told))
    (tmp_path / "recording" / "groundtruth.txt").unlink()
    drain(iterate_import(tmp_path / "recording", tmp_path / "other"))
    rgb.write_text(right)
    with pytest.raises(InputError, match=r"5000\.008 s later; if the clocks differ, subtract this from"):
        drain(iterate_import(tmp_path / "recording", tmp_path / "rig"))
    depth.write_text("".join(f"{3.0 * float(time_s):.6f} {name}\n" for time_s, name in told))
    with pytest.raises(InputError, match="check that their clocks agree, and that the times are in seconds"):
        drain(iterate_import(tmp_path / "recording", tmp_path / "rig"))
    depth.write_text("".join(f"{time_s} {name}\n" for time_s, name in told))
    drain(iterate_import(tmp_path / "recording", tmp_path / "rig"))
    assert len(load_rig(tmp_path / "rig").frames) == 2
