"""Byte order marks and line ends of other systems, in every text file of every layout."""

import pytest

from packetmesh.progress import drain
from pipeline.importing import iterate_import
from pipeline.io.rigs import load_rig
from tests.pipeline.importing.phone_captures import write_polycam, write_record3d, write_stray
from tests.pipeline.importing.recordings import LAYOUTS, orbit, write_colmap, write_sunrgbd
from tests.pipeline.importing.test_associated import write as write_associated
from tests.pipeline.importing.test_layouts import assert_same

WRITERS = {
    **LAYOUTS,
    "COLMAP with a sensor": lambda folder, rig: write_colmap(folder, rig, sensor=True),
    "SUN RGB-D": lambda folder, rig: write_sunrgbd(folder, rig.frames[0]),
    "ICL-NUIM": lambda folder, rig: write_associated(folder),
    "Stray Scanner": write_stray,
    "Polycam": write_polycam,
    "Record3D": write_record3d,
}
FORMS = {
    "UTF-8 with a mark": lambda text: text.encode("utf-8-sig"),
    "UTF-16 of Windows": lambda text: text.replace("\n", "\r\n").encode("utf-16"),
    "lines of Windows": lambda text: text.replace("\n", "\r\n").encode(),
    "lines of Windows with a mark": lambda text: text.replace("\n", "\r\n").encode("utf-8-sig"),
    "lines of an old Mac": lambda text: text.replace("\n", "\r").encode(),
    "no last line end": lambda text: text.rstrip("\n").encode(),
    "blanks at the ends": lambda text: text.replace("\n", " \t\n").encode(),
}
TEXTS = (".txt", ".json", ".csv", ".log", ".freiburg")


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("kind", WRITERS)
def test_a_recording_with_text_files_of_another_form_is_the_same_rig(tmp_path, kind, form):
    WRITERS[kind](tmp_path / "recording", orbit(3))
    drain(iterate_import(tmp_path / "recording", tmp_path / "plain"))
    for path in (tmp_path / "recording").rglob("*"):
        if path.suffix in TEXTS:
            path.write_bytes(FORMS[form](path.read_text()))
    drain(iterate_import(tmp_path / "recording", tmp_path / "rig"))
    for file in (tmp_path / "plain").rglob("*"):
        if file.is_file():
            assert file.read_bytes() == (tmp_path / "rig" / file.relative_to(tmp_path / "plain")).read_bytes()


@pytest.mark.parametrize("between", ["\t", ", ", ","])
@pytest.mark.parametrize("kind", ["TUM", "7-Scenes", "ScanNet"])
def test_numbers_may_have_tabs_or_commas_between_them(tmp_path, kind, between):
    """In lists, poses and matrices; names in a list have no blanks."""
    written = orbit(3)
    WRITERS[kind](tmp_path / "recording", written)
    for path in (tmp_path / "recording").rglob("*.txt"):
        lines = path.read_text().splitlines()
        path.write_text(
            "\n".join(line if line.startswith("#") else line.replace(" ", between) for line in lines)
        )
    drain(iterate_import(tmp_path / "recording", tmp_path / "rig"))
    for frame, expected in zip(load_rig(tmp_path / "rig").frames, written.frames, strict=True):
        assert_same(frame, expected)
