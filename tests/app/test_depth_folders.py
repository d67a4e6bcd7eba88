"""What the folders of the Depth screen ask for and tell: the hidden disc, the network, the numbers."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import viser

from app.records import Picture
from app.screens.depth import hide as hide_folder
from app.screens.depth.hide import BESIDE, BUTTON, HideFolder, fills_table, painted_line
from app.screens.depth.labels import BLANK, MEASURED, OURS, PEER_NAMES
from app.screens.depth.model import AS_IT_SAYS, LIMIT_BYTES, SHIPPED, ModelFolder, model_table
from app.screens.depth.numbers import LINES, fitted_line
from app.screens.depth.settings import with_model
from app.screens.depth.view import Disc, FillRow, HiddenView, HideRequest, ModelChoice, ModelView, SeenSample
from app.state import Spec
from packetmesh.errors import InputError
from pipeline.config import DepthConfig, PipelineConfig
from pipeline.depth.alignment import ALIGNMENTS, align_depth
from pipeline.sources import Demo
from pipeline.types import DepthMap

PICTURE = Picture(np.zeros((4, 6, 3), np.uint8), "x")
NEAREST = PEER_NAMES["nearest"]
ROWS = (FillRow(OURS, 0.0314, 0.81, 1.0, 0.2), FillRow(NEAREST, float("nan"), 0.0, 0.0, 0.004))
ANSWER = HiddenView(
    HideRequest(), "node_01", 1234, ROWS, dict.fromkeys((MEASURED, BLANK, OURS, NEAREST), PICTURE)
)


@pytest.fixture(scope="module")
def server():
    server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    yield server
    server.stop()


class Hand:
    """What a person can do to a folder."""

    def __init__(self):
        self.actions, self.asked = {}, []

    def post(self, function, *arguments):
        function(*arguments)

    def changed(self, handle, action):
        self.actions[handle.label] = (handle, action)

    def change(self, label, value):
        handle, action = self.actions[label]
        handle.value = value
        action()


WALL = SeenSample(
    np.array([[-0.4, 0.0, 2.0], [0.0, 0.0, 2.0], [0.4, 0.2, 2.0]], np.float32),
    None,
    3,
    np.array([[10, 20], [40, 20], [70, 30]]),
    81,
    41,
)
"""Three points two metres before a camera whose image has 81 x 41 pixels."""
FORWARD = np.array([0.0, 0.0, 1.0])


@pytest.fixture
def hide(server):
    hand = Hand()
    return HideFolder(server.gui, server.scene, hand.post, hand.changed, hand.asked.append), hand


def painted(server):
    """How many points are drawn as painted; None without a cloud of them."""
    handle = server.scene.get_handle_by_name("/depth/painted")
    return None if handle is None else len(handle.points)


def test_the_sliders_say_in_percent_what_is_hidden(hide):
    folder, hand = hide
    disc = Disc(0.25, 0.4, 0.1)
    folder.ask(HideRequest(3, (Disc(), disc)))
    assert (folder._x.value, folder._y.value, folder._size.value) == (25, 40, 10)
    assert hand.asked == [HideRequest(0, (Disc(), disc))]
    assert folder._status.content == hide_folder.WAITING
    folder._add()
    assert folder.discs == (Disc(), disc, disc)


def test_the_button_hides_the_disc_of_the_sliders_if_nothing_is_painted(hide):
    folder, hand = hide
    folder._ask()
    folder._ask()
    assert hand.asked == [HideRequest(0, (Disc(),)), HideRequest(0, (Disc(),))]


def test_clicks_with_the_brush_paint_where_the_point_is_seen(hide, server):
    folder, _ = hide
    folder.show(WALL, np.eye(4))
    folder.clicked(np.array([0.4, 0.2, 0.0]), FORWARD)
    assert folder.discs == ()
    folder._brush.value, folder._size.value = True, 10.0
    folder.clicked(np.array([0.4, 0.2, 0.0]), FORWARD)
    folder.clicked(np.array([-0.4, 0.0, 0.0]), FORWARD)
    assert folder.discs == (Disc(70 / 80, 30 / 40, 0.1), Disc(10 / 80, 20 / 40, 0.1))
    assert painted(server) == 2
    assert folder._status.content == painted_line(folder.discs)
    folder._undo()
    assert painted(server) == 1
    folder.clear()
    assert painted(server) is None
    assert folder._status.content == ""


def test_a_click_beside_the_cloud_says_so_and_paints_nothing(hide, server):
    folder, _ = hide
    folder.show(WALL, np.eye(4))
    folder._brush.value = True
    folder.clicked(np.array([0.0, 1.0, 0.0]), FORWARD)
    assert folder.discs == ()
    assert folder._status.content == BESIDE
    assert painted(server) is None


def test_another_disc_makes_the_answer_out_of_date(hide):
    folder, _ = hide
    folder._add()
    folder.load(ANSWER)
    folder._add()
    assert not folder._area._image.visible
    assert folder._status.content == f"2 discs painted in magenta. Paint more, or press **{BUTTON}**."


def test_the_answer_is_shown_and_forgotten_with_other_settings(hide):
    folder, _ = hide
    folder.load(ANSWER)
    assert "1,234 measured pixels of node_01" in folder._status.content
    assert folder._area._image.visible
    assert (folder._area._left.value, folder._area._right.value) == (BLANK, OURS)
    folder.forget()
    assert not folder._area._image.visible
    assert (folder._status.content, folder._table.content) == ("", "")
    folder.load(None)
    assert folder._status.content == hide_folder.SILENT


def test_the_table_has_every_way_with_its_errors():
    text = fills_table(ANSWER)
    assert all(part in text for part in (OURS, NEAREST, "0.031", "81 %", "100 %", "200 ms", "–", "0 %"))


@pytest.fixture
def network(server, tmp_path):
    hand = Hand()
    return ModelFolder(server.gui, hand.post, hand.changed, tmp_path, hand.asked.append), hand


def uploaded(name, content=b"onnx"):
    return SimpleNamespace(name=name, content=content)


def test_a_preset_and_a_kind_are_chosen_with_the_file(network):
    _, hand = network
    hand.change("Preset", "midas-small")
    hand.change("Gives", "inverse")
    hand.change("Preset", AS_IT_SAYS)
    assert hand.asked == [
        ModelChoice(None, "midas-small"),
        ModelChoice(None, "midas-small", "inverse"),
        ModelChoice(None, None, "inverse"),
    ]


def test_an_upload_is_kept_in_the_folder_listed_and_tried(network, tmp_path):
    folder, hand = network
    folder._keep(uploaded("mine.onnx", b"1"))
    folder._keep(uploaded("../mine.onnx", b"2"))
    paths = [Path(request.model) for request in hand.asked]
    assert [path.read_bytes() for path in paths] == [b"1", b"2"]
    assert {path.parent for path in paths} == {tmp_path}
    assert folder._model.options == (SHIPPED, "mine.onnx", "mine.onnx′")
    hand.change("Network file", SHIPPED)
    assert hand.asked[-1] == ModelChoice()


def test_a_huge_upload_is_one_sentence_and_not_kept(network, tmp_path):
    folder, hand = network
    content = type("Huge", (), {"__len__": lambda self: LIMIT_BYTES + 1})()
    with pytest.raises(InputError, match=r"big\.onnx has 128 MB; the app takes networks up to 128 MB"):
        folder._keep(uploaded("big.onnx", content))
    assert hand.asked == []
    assert not list(tmp_path.iterdir())


def test_what_cannot_be_used_waits_for_what_it_expects_to_be_said(network):
    folder, hand = network
    folder.write(DepthConfig())
    folder._keep(uploaded("odd.onnx"))
    folder.load(None)
    assert "before is kept" in folder._status.content
    assert folder._model.value == "odd.onnx"
    hand.change("Preset", "midas-small")
    assert hand.asked[-1] == ModelChoice(hand.asked[0].model, "midas-small")
    folder.write(DepthConfig())
    assert (folder._model.value, folder._preset.value) == (SHIPPED, AS_IT_SAYS)


def test_only_a_foreign_network_can_be_told_its_input(network):
    folder, hand = network
    assert not folder._advanced.visible
    folder._keep(uploaded("odd.onnx"))
    assert folder._advanced.visible
    folder._size.value, folder._normalisation.value = (384.0, 256.0), "unit"
    folder._chosen()
    assert hand.asked[-1] == ModelChoice(hand.asked[0].model, None, None, 384, 256, "unit")
    hand.change("Network file", SHIPPED)
    assert hand.asked[-1] == ModelChoice()
    assert not folder._advanced.visible


def test_a_network_from_the_command_line_is_listed_by_its_name(network):
    folder, _ = network
    there = DepthConfig("/somewhere/other.onnx", "monodepth2", "inverse", 640, 192, "unit")
    folder.write(there)
    assert (folder._size.value, folder._normalisation.value) == ((640.0, 192.0), "unit")
    assert folder._advanced.visible
    assert (folder._model.value, folder._preset.value, folder._kind.value) == (
        "other.onnx",
        "monodepth2",
        "inverse",
    )


def test_the_network_tells_what_it_is(network):
    folder, _ = network
    view = ModelView(ModelChoice(), "inverse", "CPUExecutionProvider", 0.023, 5_000_000, {"licence": "MIT"})
    folder.load(view)
    assert "line of 1/depth" in folder._status.content
    text = model_table(view)
    assert all(
        part in text
        for part in ("inverse depth", "CPUExecutionProvider", "23 ms", "5.0 MB", "licence", "MIT")
    )


def test_the_edit_takes_the_network_and_nothing_else():
    request = ModelChoice("a.onnx", "midas-small", "inverse", 384, 256, "unit")
    config = with_model(request)(PipelineConfig())
    assert config.depth == DepthConfig("a.onnx", "midas-small", "inverse", 384, 256, "unit")
    text = Spec(Demo("office"), config=config).command()
    assert "depth.input_width_px=384 depth.input_height_px=256 depth.normalisation=unit" in text
    assert with_model(ModelChoice())(config) == PipelineConfig()


def test_the_local_mode_of_disparity_has_another_line():
    node = SimpleNamespace(alignment_mode="local", disparity=True, coefficients={"a": 0.5, "b": 0.25})
    assert fitted_line(node) == "1/z′ = (0.500/z +0.250 1/m) / exp C"


@pytest.mark.parametrize("mode", list(ALIGNMENTS))
def test_every_alignment_has_its_line_written_out(mode):
    z_m = np.linspace(1.0, 4.0, 400, dtype=np.float32).reshape(20, 20)
    result = align_depth(DepthMap(z_m, "relative"), DepthMap(2.0 * z_m), mode)
    text = fitted_line(
        SimpleNamespace(alignment_mode=mode, disparity=False, coefficients=result.coefficients)
    )
    assert text == LINES[mode].format(**result.coefficients)
    assert "2.000" in text or mode in ("none", "affine_inverse")
    assert "0.500" in text or mode != "affine_inverse"
