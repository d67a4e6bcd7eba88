"""A depth image without any depth costs its own frame only, wherever it is in the recording."""

from functools import partial

import cv2
import numpy as np
import pytest

from packetmesh.progress import drain
from pipeline.importing import iterate_import
from pipeline.importing.colmap import read_depth_map
from pipeline.importing.recorded import open_recording
from pipeline.io.images import NoDepthError
from pipeline.io.rigs import load_rig
from tests.pipeline.importing.recordings import LAYOUTS, orbit, write_colmap

WRITERS = LAYOUTS | {"COLMAP with a sensor": partial(write_colmap, metres_a_unit=0.5, sensor=True)}
BLANK_MAP = b"40&30&1&" + bytes(4 * 30 * 40)


def blank(folder, which):
    """Remove all depth from some of a recording's depth images, by their places in the order of names."""
    depths = [path for path in sorted(folder.rglob("*depth*/**/*")) if path.is_file()]
    depths = depths or sorted(folder.glob("*.depth.png"))
    for path in (depths[k] for k in which):
        if path.suffix == ".bin":
            path.write_bytes(BLANK_MAP)
        else:
            cv2.imwrite(str(path), np.zeros((30, 40), np.uint16))


@pytest.mark.parametrize("blind", [0, 1, 2])
@pytest.mark.parametrize("kind", WRITERS)
def test_a_blank_depth_image_is_left_out(tmp_path, kind, blind):
    written = orbit(3)
    WRITERS[kind](tmp_path / "recording", written)
    blank(tmp_path / "recording", [blind])
    report = drain(iterate_import(tmp_path / "recording", tmp_path / "rig"))
    assert "1 frame without any depth was left out" in report.notes
    expected = [frame for k, frame in enumerate(written.frames) if k != blind]
    for frame, own in zip(load_rig(tmp_path / "rig").frames, expected, strict=True):
        np.testing.assert_array_equal(frame.rgb, own.rgb)
        np.testing.assert_allclose(frame.depth.z_m, own.depth.z_m, atol=1e-6)
    recording = open_recording(tmp_path / "recording")
    assert [recording.view(k).depth.valid.any() for k in range(3)] == [k != blind for k in range(3)]


@pytest.mark.parametrize("kind", WRITERS)
def test_a_recording_of_blank_depth_images_is_refused(tmp_path, kind):
    WRITERS[kind](tmp_path / "recording", orbit(3))
    blank(tmp_path / "recording", range(3))
    with pytest.raises(NoDepthError):
        drain(iterate_import(tmp_path / "recording", tmp_path / "rig"))
    assert not (tmp_path / "rig").exists()


def test_a_blank_map_of_colmap_is_no_damaged_one(tmp_path):
    (tmp_path / "map.bin").write_bytes(BLANK_MAP)
    with pytest.raises(NoDepthError, match=r"map\.bin has no depth anywhere"):
        read_depth_map(tmp_path / "map.bin")
