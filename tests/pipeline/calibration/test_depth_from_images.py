"""Depth images are found beside their own photographs."""

from pipeline.calibration.depth_from_images import depth_beside


def test_photographs_of_one_name_in_two_folders_each_have_their_own_depth(tmp_path):
    photographs = [tmp_path / day / "color_00.png" for day in ("monday", "tuesday", "friday")]
    for path in photographs:
        path.parent.mkdir()
        path.touch()
        (path.parent / "depth_00.png").touch()
    (tmp_path / "friday" / "depth_00.png").unlink()
    assert depth_beside(photographs) == {
        str(path): path.parent / "depth_00.png" for path in photographs if path.parent.name != "friday"
    }
