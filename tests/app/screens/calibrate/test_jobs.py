"""The jobs of the Calibrate screen: the folder that the command writes, and nothing computed twice."""

import shlex
import shutil
from dataclasses import replace

import pytest

from app.cli import main
from app.compute.state import Spec
from app.compute.store import Store
from app.screens.calibrate import cameras as bias
from app.screens.calibrate.job import calibrate_job
from app.screens.calibrate.request import calibrate_command, views_in
from app.screens.calibrate.use_job import use_job
from packetmesh.progress import drain
from pipeline.sources import RigFolder
from tests.app.boards import BLANK, MOMENTS, save_believing_rig, save_boards

pytestmark = pytest.mark.xdist_group("calibrate panel")
COMMAND_ONLY = {
    "metrics.json",
    "report.html",
    "camera.yaml",
    "camera_info.yaml",
    "cameras.txt",
    "camchain.yaml",
    "matlab.txt",
}
"""What the command leaves beside what is laid over a rig: numbers, pictures, and other programs' files."""
TAKEN = {"intrinsics.json", "pose.txt"}


@pytest.fixture(scope="module")
def boards(tmp_path_factory):
    folder = tmp_path_factory.mktemp("boards")
    save_boards(folder)
    return folder


@pytest.fixture(scope="module")
def apart(boards, tmp_path_factory):
    """The same photographs as of one node, the first camera of which is the depth sensor's own."""
    folder = tmp_path_factory.mktemp("apart")
    (folder / "node_00").mkdir()
    (folder / "board.json").write_bytes((boards / "board.json").read_bytes())
    for source, kinds in (
        ("node_00", {"color": "infrared", "depth": "depth"}),
        ("node_01", {"color": "color"}),
    ):
        for path in (boards / source).iterdir():
            kind, _, rest = path.name.partition("_")
            (folder / "node_00" / f"{kinds[kind]}_{rest}").write_bytes(path.read_bytes())
    return folder


@pytest.fixture
def strangers(boards, tmp_path):
    """The same photographs, of two cameras that never see the board together."""
    for path in sorted(boards.rglob("*.*")):
        copy = tmp_path / "strangers" / path.relative_to(boards)
        if path.parent.name == "node_01":
            copy = copy.with_name(path.name.replace("color_", "color_1"))
        copy.parent.mkdir(parents=True, exist_ok=True)
        copy.write_bytes(path.read_bytes())
    return tmp_path / "strangers"


def contents(folder):
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def names_in(files, node):
    return {name.removeprefix(f"{node}/") for name in files if name.startswith(node)}


def assert_alike(store, views, rig, tmp_path):
    """The names of what the screen wrote, which the command that it prints wrote with the same bytes."""
    spec = Spec(RigFolder(str(rig)), views=views)
    drain(use_job(store, spec, str(tmp_path / "screen")))
    *words, _ = shlex.split(calibrate_command(views, spec.source))
    main([*words[1:], str(tmp_path / "command")])
    used, written = contents(tmp_path / "screen"), contents(tmp_path / "command")
    assert {name.rpartition("/")[2] for name in set(written) - set(used)} == COMMAND_ONLY
    assert {name for name in used if written.get(name) != used[name]} == set()
    return set(used)


@pytest.mark.parametrize(
    "dropped", [(), (("node_00", "2"), ("node_01", "5"))], ids=["all views", "some dropped"]
)
def test_the_screen_and_the_command_write_the_same_bytes_of_two_cameras(store, boards, tmp_path, dropped):
    save_believing_rig(tmp_path / "rig")
    used = assert_alike(store, replace(views_in(boards), dropped=dropped), tmp_path / "rig", tmp_path)
    assert names_in(used, "node_00") == TAKEN | {"depth_correction.json"}
    assert names_in(used, "node_01") == TAKEN


@pytest.mark.parametrize("dropped", [(), (("node_00/infrared", "2"),)], ids=["all views", "one dropped"])
def test_the_screen_and_the_command_write_the_same_bytes_of_a_depth_camera(store, apart, tmp_path, dropped):
    save_believing_rig(tmp_path / "rig", 1)
    used = assert_alike(store, replace(views_in(apart), dropped=dropped), tmp_path / "rig", tmp_path)
    beside = {"depth_intrinsics.json", "extrinsics.json", "depth_correction.json"}
    assert names_in(used, "node_00") == TAKEN | beside


def test_the_screen_and_the_command_write_the_same_bytes_of_one_camera(store, boards, tmp_path):
    """Which the command writes where it is told to, and the screen where a rig has its first node."""
    save_believing_rig(tmp_path / "rig", 1)
    shutil.copytree(boards / "node_00", tmp_path / "one" / "node_00")
    shutil.copy(boards / "board.json", tmp_path / "one")
    views, source = views_in(tmp_path / "one"), RigFolder(str(tmp_path / "rig"))
    drain(use_job(store, Spec(source, views=views), str(tmp_path / "screen")))
    *words, _ = shlex.split(calibrate_command(views, source))
    main([*words[1:], str(tmp_path / "command")])
    used, written = contents(tmp_path / "screen" / "node_00"), contents(tmp_path / "command")
    assert set(used) == {"intrinsics.json", "depth_correction.json"}
    assert set(written) - set(used) == COMMAND_ONLY
    assert all(written[name] == used[name] for name in used)


def fitted(monkeypatch):
    """The nodes whose depth was compared with the board, from now on."""
    done, fit = [], bias.node_with_depth
    monkeypatch.setattr(
        bias, "node_with_depth", lambda node, reports: done.append(node.name) or fit(node, reports)
    )
    return done


def calibrated(store, views):
    return drain(calibrate_job(store, Spec(RigFolder("none"), views=views)))


def test_a_dropped_view_changes_the_depth_of_its_camera_alone(strangers, tmp_path, monkeypatch):
    store, views, done = Store(str(tmp_path / "store")), views_in(strangers), fitted(monkeypatch)
    before = calibrated(store, views)
    assert "never sees the board at a moment" in before.rig
    assert done == ["node_00", "node_01"]
    after = calibrated(store, replace(views, dropped=(("node_00", "2"),)))
    assert done == ["node_00", "node_01", "node_00"]
    assert len(after.camera("node_00").calibration.views) == MOMENTS - 1
    assert after.depth["node_00"].rows != before.depth["node_00"].rows
    assert calibrated(store, views).depth.keys() == before.depth.keys()
    assert len(done) == 3


def test_cameras_that_were_placed_together_change_together(boards, tmp_path, monkeypatch):
    store, views, done = Store(str(tmp_path / "store")), views_in(boards), fitted(monkeypatch)
    before = calibrated(store, views)
    after = calibrated(store, replace(views, dropped=(("node_01", "2"),)))
    assert done == ["node_00", "node_01"] * 2
    matrices = [one.camera("node_00").calibration.matrix for one in (before, after)]
    assert (matrices[0] != matrices[1]).any()


def test_a_depth_camera_without_a_lens_leaves_its_node_without_a_bias(store, apart):
    every = (*(str(moment) for moment in range(MOMENTS)), BLANK)
    views = replace(views_in(apart), dropped=tuple(("node_00/infrared", moment) for moment in every))
    view = calibrated(store, views)
    assert view.camera("node_00/infrared").calibration is None
    assert view.camera("node_00").calibration is not None
    assert "node_00/infrared has no lens" in view.depth["node_00"]
