"""Lists of times, files and poses as other programs write them."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from packetmesh.errors import InputError
from packetmesh.progress import drain
from pipeline.importing import iterate_import
from pipeline.io.rigs import load_rig
from tests.pipeline.importing.recordings import orbit, write_tum
from tests.pipeline.importing.test_associated import write as write_associated
from tests.pipeline.importing.test_layouts import assert_same

LISTS = ("rgb.txt", "depth.txt", "groundtruth.txt")


@pytest.fixture
def written(tmp_path):
    rig = orbit(3)
    write_tum(tmp_path / "recording", rig)
    return rig


def change(folder, names, line_of):
    """Rewrite the lines of lists that are no comments."""
    for name in names:
        lines = (folder / name).read_text().splitlines()
        changed = [line if line.startswith("#") else line_of(line) for line in lines]
        (folder / name).write_text("\n".join(changed) + "\n")


def imported(tmp_path, **options):
    report = drain(iterate_import(tmp_path / "recording", tmp_path / "rig", **options))
    return report, load_rig(tmp_path / "rig").frames


def assert_all_same(frames, rig):
    for frame, expected in zip(frames, rig.frames, strict=True):
        assert_same(frame, expected)


@pytest.mark.parametrize("units", [10**3, 10**6, 10**9])
@pytest.mark.parametrize("names", [LISTS, LISTS[:2]])
def test_clocks_in_fractions_of_a_second_are_told_by_their_size(tmp_path, written, units, names):
    """Also if the poses have another unit than the images."""

    def line_of(line):
        time_s, _, rest = line.partition(" ")
        return f"{round(float(time_s) * units)} {rest}"

    change(tmp_path / "recording", names, line_of)
    report, frames = imported(tmp_path)
    assert_all_same(frames, written)
    assert report.frames[1].time_s - report.frames[0].time_s == pytest.approx(1 / 30, abs=1.1e-3)


@pytest.mark.parametrize(
    "name_of",
    [
        lambda folder, name: f"./{name}",
        lambda folder, name: name.replace("/", "\\"),
        lambda folder, name: str(folder.resolve() / name),
    ],
    ids=["dot", "Windows", "absolute"],
)
def test_files_are_found_by_other_forms_of_their_names(tmp_path, written, name_of):
    folder = tmp_path / "recording"
    change(folder, LISTS[:2], lambda line: f"{line.split()[0]} {name_of(folder, line.split()[1])}")
    assert_all_same(imported(tmp_path)[1], written)


def test_a_file_elsewhere_is_refused_until_it_is_named_from_the_folder_on(tmp_path, written):
    folder = tmp_path / "recording"
    change(folder, LISTS[:1], lambda line: line.replace(" rgb/", " /home/me/rgb/"))
    with pytest.raises(
        InputError, match=r"rgb.txt in .* names /home/me/rgb/.* outside this folder; try names"
    ):
        imported(tmp_path)
    change(folder, LISTS[:1], lambda line: line.replace(" /home/me/rgb/", " rgb/"))
    assert_all_same(imported(tmp_path)[1], written)


def test_frames_without_their_file_are_left_out_and_counted(tmp_path, written):
    next(iter((tmp_path / "recording" / "rgb").iterdir())).unlink()
    report, frames = imported(tmp_path)
    assert len(frames) == 2
    assert any("1 of 3 frames of" in note and "lack an image" in note for note in report.notes)
    for path in (tmp_path / "recording" / "rgb").iterdir():
        path.unlink()
    with pytest.raises(InputError, match=r"No two images .* exist, such as .*; try to unpack the images"):
        drain(iterate_import(tmp_path / "recording", tmp_path / "none"))


@pytest.mark.parametrize(
    ("heading", "first_w"),
    [
        ("#timestamp, p_RS_R_x [m], p_y, p_z, q_RS_w [], q_RS_x [], q_RS_y [], q_RS_z []", True),
        ("# timestamp tx ty tz qw qx qy qz", True),
        ("# timestamp tx ty tz qx qy qz qw", False),
    ],
)
def test_a_quaternion_has_the_order_of_its_heading(tmp_path, written, heading, first_w):
    """EuRoC's scalar comes first."""
    file = tmp_path / "recording" / "groundtruth.txt"
    rows = [line.split() for line in file.read_text().splitlines() if not line.startswith("#")]
    if first_w:
        rows = [[*row[:4], row[7], *row[4:7]] for row in rows]
    file.write_text("\n".join([heading, *map(" ".join, rows)]))
    assert_all_same(imported(tmp_path)[1], written)


@pytest.mark.parametrize(
    "row_of",
    [
        lambda T: T[:3].ravel(),
        lambda T: T.ravel(),
        lambda T: np.eye(4)[:3].ravel(),
        lambda T: [*T[:3, 3], *(2.0 * Rotation.from_matrix(T[:3, :3]).as_quat())],
    ],
    ids=["3 x 4", "4 x 4", "3 x 4 of the first camera", "length 2"],
)
def test_a_trajectory_of_other_numbers_is_refused(tmp_path, written, row_of):
    file = tmp_path / "recording" / "groundtruth.txt"
    times = [float(line.split()[0]) for line in file.read_text().splitlines() if line[0] != "#"][1::3]
    rows = [row_of(frame.T_world_camera) for frame in written.frames]
    file.write_text("\n".join(f"{t} {' '.join(map(str, row))}" for t, row in zip(times, rows, strict=True)))
    with pytest.raises(InputError, match=r"has the pose '.*', no quaternion; try a time, tx ty tz in metres"):
        imported(tmp_path)


def test_images_of_one_time_are_one_node(tmp_path):
    """All poses would be that of the first image."""
    write_associated(tmp_path / "recording")
    change(tmp_path / "recording", ["associations.txt"], lambda line: line.replace("1 ", "0 "))
    report, frames = imported(tmp_path, frames=6)
    assert [frame.time_s for frame in report.frames] == [0.0, 2.0]
    assert any("1 frames have the time of another frame and were left out" in note for note in report.notes)
    assert len(frames) == 2
    assert not np.allclose(frames[0].T_world_camera, frames[1].T_world_camera)


def test_images_without_a_partner_are_counted(tmp_path, written):
    """``write_tum`` writes a photograph and a depth image without one; one depth image more is 30 ms late."""
    note = "3 pairs: 1 of 4 images of rgb.txt and 1 of 4 of depth.txt have no partner"
    assert any(one.startswith(note) for one in imported(tmp_path)[0].notes)
    file = tmp_path / "recording" / "depth.txt"
    lines = file.read_text().splitlines()
    lines[1] = f"{float(lines[1].split()[0]) - 0.03} {lines[1].split()[1]}"
    file.write_text("\n".join(lines))
    report = drain(iterate_import(tmp_path / "recording", tmp_path / "other"))
    assert any(one.startswith("2 pairs: 2 of 4 images of rgb.txt and 2 of 4") for one in report.notes)


@pytest.mark.parametrize(("late_s", "says"), [(0.03, "0.030 s later"), (-0.025, "0.025 s earlier")])
def test_clocks_that_differ_are_named_by_how_much_and_can_be_set_right(tmp_path, late_s, says):
    """A picture every 100 ms."""
    folder = tmp_path / "recording"
    write_tum(folder, orbit(3))
    rows = {"rgb.txt": 0.0, "depth.txt": late_s}
    for name, shift_s in rows.items():
        images = [line.split()[1] for line in (folder / name).read_text().splitlines()[1:4]]
        lines = [f"{5.0 + 0.1 * k + shift_s:.6f} {image}" for k, image in enumerate(images)]
        (folder / name).write_text("\n".join(lines))
    with pytest.raises(InputError, match=f"3 would be pairs if the depth images were not {says}") as refused:
        imported(tmp_path)
    assert ("subtract this from" if late_s > 0.0 else "add this to") in str(refused.value)
    change(folder, ["depth.txt"], lambda line: f"{float(line.split()[0]) - late_s:.6f} {line.split()[1]}")
    assert len(imported(tmp_path)[1]) == 3


def test_images_that_are_listed_again_are_left_out_and_counted(tmp_path, written):
    for name in LISTS[:2]:
        file = tmp_path / "recording" / name
        time_s, image = file.read_text().splitlines()[1].split()
        file.write_text(file.read_text() + f"{float(time_s) + 10.0} {image}\n")
    report, frames = imported(tmp_path)
    assert len(frames) == 3
    assert "1 frame names an image that an earlier frame has, and was left out" in report.notes
