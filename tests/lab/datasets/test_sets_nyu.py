"""NYU Depth v2 from its labelled file and from folders, and the splits of both."""

import sys

import numpy as np
import pytest
from scipy.io import savemat

from lab.datasets import open_set
from packetmesh.errors import InputError
from tests.lab.datasets.setfiles import cut, picture, write_rgb, write_units

WIDTH_PX, HEIGHT_PX = 640, 480
COUNT = 3


@pytest.fixture
def pictures():
    return np.stack([picture(WIDTH_PX, HEIGHT_PX, seed) for seed in range(COUNT)])


@pytest.fixture
def depths_m():
    z_m = np.random.default_rng(1).uniform(0.7, 9.9, (COUNT, HEIGHT_PX, WIDTH_PX)).astype(np.float32)
    z_m[:, 100:150, 200:300] = 0.0
    return z_m


@pytest.fixture
def labelled(tmp_path, pictures, depths_m):
    """As Matlab writes it: axes in reverse."""
    h5py = pytest.importorskip("h5py")
    file = tmp_path / "nyu_depth_v2_labeled.mat"
    with h5py.File(file, "w") as mat:
        mat["images"] = pictures.transpose(0, 3, 2, 1)
        mat["rawDepths"] = depths_m.transpose(0, 2, 1)
        mat["depths"] = np.where(depths_m > 0, depths_m, 5.0).transpose(0, 2, 1)
    return file


def test_the_labelled_file_gives_upright_pictures_and_measured_depth(tmp_path, labelled, pictures, depths_m):
    for spec in (f"nyu={tmp_path}", f"nyu={labelled}"):
        pairs = list(open_set(spec))
        assert len(pairs) == COUNT
        for row, pair in enumerate(pairs):
            np.testing.assert_array_equal(pair.rgb, pictures[row])
            np.testing.assert_array_equal(pair.truth_m, np.where(depths_m[row] > 0, depths_m[row], np.nan))


def test_only_the_crop_of_eigen_is_judged(labelled):
    judged = next(open_set(f"nyu={labelled}")).judged
    rows, columns = np.nonzero(judged)
    assert (rows.min(), rows.max(), columns.min(), columns.max()) == (45, 470, 41, 600)
    assert judged.sum() == 426 * 560


def test_the_standard_split_counts_from_one(labelled):
    splits = {"testNdxs": np.array([[1], [3]]), "trainNdxs": np.array([[2]])}
    savemat(labelled.with_name("splits.mat"), splits)
    assert [pair.picture.name for pair in open_set(f"nyu={labelled}")] == ["0001", "0003"]


@pytest.mark.parametrize(
    ("rgb_file", "depth_file"),
    [
        ("nyu2_train/office_0003_out/37.jpg", "nyu2_train/office_0003_out/37.png"),
        ("bathroom/rgb_00045.jpg", "bathroom/sync_depth_00045.png"),
        ("nyu2_test/00000_colors.png", "nyu2_test/00000_depth.png"),
    ],
)
def test_folders_of_pictures_are_paired_by_their_names(tmp_path, rgb_file, depth_file):
    rgb = np.full((HEIGHT_PX, WIDTH_PX, 3), 90, np.uint8)
    write_rgb(tmp_path / rgb_file, rgb)
    write_units(tmp_path / depth_file, np.full((HEIGHT_PX, WIDTH_PX), 2345))
    (pair,) = open_set(f"nyu={tmp_path}")
    assert pair.picture == tmp_path / rgb_file
    np.testing.assert_array_equal(pair.rgb, rgb)
    np.testing.assert_allclose(pair.truth_m, 2.345, rtol=1e-6)
    assert pair.judged.sum() == 426 * 560


def test_the_standard_split_holds_for_numbered_pictures(tmp_path):
    for number in (1, 2, 3):
        write_rgb(tmp_path / f"{number}.jpg", picture())
        write_units(tmp_path / f"{number}.png", np.full((6, 8), 1000))
    splits = {"testNdxs": np.array([[2]]), "trainNdxs": np.array([[1], [3]])}
    savemat(tmp_path / "splits.mat", splits)
    (pair,) = open_set(f"nyu={tmp_path}")
    assert pair.picture == tmp_path / "2.jpg"
    assert pair.judged is None  # a small picture has no standard crop


def test_bad_files_are_named(tmp_path, labelled):
    splits = labelled.with_name("splits.mat")
    savemat(splits, {"other": np.ones(3)})
    with pytest.raises(InputError, match=f"{splits} has no testNdxs"):
        open_set(f"nyu={tmp_path}")
    splits.write_bytes(b"not Matlab's")
    with pytest.raises(InputError, match=f"{splits} has no testNdxs"):
        open_set(f"nyu={tmp_path}")
    splits.unlink()
    cut(labelled)
    with pytest.raises(InputError, match=f"{labelled} is not the labelled NYU Depth v2 or is damaged"):
        open_set(f"nyu={tmp_path}")


def test_without_h5py_the_file_is_refused_in_a_sentence(monkeypatch, labelled):
    monkeypatch.setitem(sys.modules, "h5py", None)
    with pytest.raises(InputError, match="needs the package h5py, which is not installed; try pip install"):
        open_set(f"nyu={labelled}")
