"""Output files are whole or absent."""

import numpy as np
import pytest

from packetmesh.errors import InputError
from packetmesh.files import atomic_path, text_in, writable_folder
from pipeline.io.clouds import write_cloud
from pipeline.io.images import write_color, write_depth_mm
from pipeline.io.intrinsics import write_intrinsics
from pipeline.io.meshes import write_mesh
from pipeline.types import CameraIntrinsics, DepthMap, PointCloud, Surface


def test_a_written_file_is_there_and_alone(tmp_path):
    with atomic_path(tmp_path / "new" / "deep" / "file.txt") as sibling:
        assert sibling.suffix == ".txt"
        assert sibling.parent == tmp_path / "new" / "deep"
        sibling.write_text("whole")
    assert [path.name for path in (tmp_path / "new" / "deep").iterdir()] == ["file.txt"]
    assert (tmp_path / "new" / "deep" / "file.txt").read_text() == "whole"


def half_write(path, error):
    with atomic_path(path) as sibling:
        sibling.write_text("half")
        raise error


@pytest.mark.parametrize("error", [ValueError, KeyboardInterrupt])
def test_a_failed_write_leaves_no_file(tmp_path, error):
    with pytest.raises(error):
        half_write(tmp_path / "file.txt", error)
    assert list(tmp_path.iterdir()) == []


def test_a_failed_write_leaves_the_older_file(tmp_path):
    (tmp_path / "file.txt").write_text("old")
    with pytest.raises(RuntimeError):
        half_write(tmp_path / "file.txt", RuntimeError)
    assert [path.name for path in tmp_path.iterdir()] == ["file.txt"]
    assert (tmp_path / "file.txt").read_text() == "old"


def test_a_full_disk_is_a_readable_error(tmp_path):
    with pytest.raises(InputError, match=r"file\.txt cannot be written \(No space left"):
        half_write(tmp_path / "file.txt", OSError(28, "No space left on device"))
    assert list(tmp_path.iterdir()) == []


WRITERS = {
    "file.txt": lambda path: atomic_path(path).__enter__(),
    "color.png": lambda path: write_color(path, np.zeros((4, 4, 3), np.uint8)),
    "depth.png": lambda path: write_depth_mm(path, DepthMap(np.ones((4, 4), np.float32))),
    "camera.json": lambda path: write_intrinsics(path, CameraIntrinsics.pinhole(1.0, 1.0, 1.0, 1.0, 4, 4)),
    "cloud.ply": lambda path: write_cloud(path, PointCloud(np.zeros((4, 3)))),
    "mesh.glb": lambda path: write_mesh(path, Surface(np.eye(3), np.array([[0, 1, 2]]))),
    "folder": writable_folder,
}


@pytest.mark.parametrize("name", WRITERS)
def test_a_folder_that_cannot_be_written_is_named(tmp_path, name):
    """A file stands where the folder should be, which stops even an administrator."""
    (tmp_path / "taken").write_text("")
    with pytest.raises(InputError, match=r"taken.*cannot be written.*; try another folder"):
        WRITERS[name](tmp_path / "taken" / name)
    assert [path.name for path in tmp_path.iterdir()] == ["taken"]


@pytest.mark.parametrize("words", ["hello world", "Привет, как дела", "你好世界"])
@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16"])
def test_text_of_any_language_is_read_as_windows_saves_it(words, encoding):
    assert text_in(f"{words}\r\n{words}".encode(encoding)) == f"{words}\n{words}"
