"""A network that takes image and depth, on the Depth screen: told apart, tried, and judged by the brush."""

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("onnx")

from onnx import helper

from app.compute.state import Spec
from app.screens.depth.hide_job import hide_job
from app.screens.depth.job import depth_job
from app.screens.depth.labels import AS_IN_FILE
from app.screens.depth.model import COMPLETES, SHIPPED, ModelFolder, model_table
from app.screens.depth.model_job import model_job
from app.screens.depth.numbers import depth_table
from app.screens.depth.settings import with_model
from app.screens.depth.view import Disc, HideRequest, ModelChoice
from packetmesh.errors import InputError, ReconstructionError
from packetmesh.progress import drain as end
from pipeline.config import DepthConfig
from pipeline.depth.fillers import PEERS
from pipeline.sources import Demo
from tests.app.fakes import ui_of
from tests.pipeline.depth import networks

SPEC = Spec(Demo("box-on-table"))
OPEN = {"image": ("n", 3, "h", "w"), "depth": ("n", 1, "h", "w")}
DISC = HideRequest(0, (Disc(0.15, 0.35, 0.2),))


def mean_filler(path):
    """Holes get the mean of all pixels of the depth image, which is less than that of the measured ones."""
    nodes = [
        helper.make_node("ReduceMean", ["image"], ["m"], keepdims=0),
        helper.make_node("Sub", ["m", "m"], ["zero"]),
        helper.make_node("ReduceMean", ["depth"], ["mean"], keepdims=0),
        helper.make_node("Add", ["depth", "zero"], ["seen"]),
        helper.make_node("Greater", ["seen", "zero"], ["known"]),
        helper.make_node("Where", ["known", "seen", "mean"], ["depth_out"]),
    ]
    return networks.completion(path, nodes, OPEN, OPEN["depth"], metadata={"author": "somebody"})


@pytest.fixture
def own(tmp_path):
    return mean_filler(tmp_path / "mine.onnx")


def spec_with(own):
    return replace(SPEC, config=replace(SPEC.config, depth=DepthConfig(completion=str(own))))


def test_it_is_told_by_its_inputs_and_becomes_the_completion(own):
    view = end(model_job(None, SPEC, ModelChoice(str(own), normalisation="bytes")))
    assert view.choice == ModelChoice(completion=str(own), completion_normalisation="bytes")
    assert view.kind == "metric"
    assert view.size_bytes == own.stat().st_size
    config = with_model(view.choice)(SPEC.config).depth
    assert (config.model, config.completion) == (None, str(own))
    assert config.completes
    text = model_table(view)
    assert "image and depth" in text
    assert "somebody" in text


@pytest.mark.parametrize("more", [{"preset": "midas-small"}, {"model_kind": "inverse"}])
def test_settings_of_other_networks_are_one_sentence(own, more):
    with pytest.raises(InputError, match=r"mine\.onnx takes image and depth"):
        end(model_job(None, SPEC, ModelChoice(str(own), **more)))


def test_one_that_gives_no_depth_is_not_taken(tmp_path):
    nodes = [
        helper.make_node("ReduceMean", ["image"], ["m"], keepdims=0),
        helper.make_node("Sub", ["m", "m"], ["zero"]),
        helper.make_node("Mul", ["depth", "zero"], ["depth_out"]),
    ]
    file = networks.completion(tmp_path / "zero.onnx", nodes, OPEN, OPEN["depth"])
    with pytest.raises(ReconstructionError, match="gives no positive depth"):
        end(model_job(None, SPEC, ModelChoice(str(file))))


def test_the_brush_measures_it_beside_the_one_that_ships(store, own):
    rows = {row.name: row for row in end(hide_job(store, spec_with(own), DISC)).rows}
    assert list(rows) == ["ours", "shipped", "network", *PEERS]
    before = {row.name: row for row in end(hide_job(store, SPEC, DISC)).rows}
    assert "shipped" not in before
    for name in ("abs_rel", "within_share", "filled_share"):
        np.testing.assert_equal(getattr(rows["shipped"], name), getattr(before["ours"], name))
    assert rows["ours"].within_share < rows["shipped"].within_share


def test_its_name_is_in_the_table(store, own):
    (node, *_) = end(depth_job(store, spec_with(own))).nodes
    assert node.completion == "mine.onnx"
    assert "mine.onnx (colours and depth)" in depth_table(node)


def test_the_folder_shows_it_and_gives_it_back(own, tmp_path):
    ui, asked = ui_of(), []
    folder = ModelFolder(ui, tmp_path, asked.append)
    folder.write(DepthConfig(completion=str(own), completion_normalisation="unit"))
    assert ui.gui.find("Network file").value == "mine.onnx"
    assert ui.gui.find("Pixel values").value == "unit"
    assert ui.gui.find("Size (px)").seen
    folder.load(end(model_job(None, SPEC, ModelChoice(str(own)))))
    assert str(COMPLETES) in ui.gui.text()
    ui.gui.set("Network file", SHIPPED)
    assert asked == [ModelChoice()]
    folder.write(DepthConfig())
    assert ui.gui.find("Pixel values").value == AS_IN_FILE
