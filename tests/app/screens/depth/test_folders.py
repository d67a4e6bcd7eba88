"""What the folders of the Depth screen ask for and tell: the hidden disc, the network, the numbers."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from app.compute.records import Picture
from app.compute.state import Spec
from app.screens.depth.hide import BUTTON, NO_POINT, NO_RESULT, WAITING, HideFolder, fills_table, painted_line
from app.screens.depth.labels import AS_IN_FILE, FILLS
from app.screens.depth.model import LIMIT_BYTES, SHIPPED, ModelFolder
from app.screens.depth.numbers import LINES, fitted_line
from app.screens.depth.settings import with_model
from app.screens.depth.view import Disc, FillRow, HiddenView, HideRequest, ModelChoice, ModelView, SeenSample
from packetmesh.errors import InputError
from pipeline.config import DepthConfig, PipelineConfig
from pipeline.depth.alignment import ALIGNMENTS, align_depth
from pipeline.sources import Demo
from pipeline.types import DepthMap
from tests.app.fakes import ui_of

PICTURE = Picture(np.zeros((4, 6, 3), np.uint8), "x")
ROWS = (FillRow("ours", 0.0314, 0.81, 1.0, 0.2), FillRow("nearest", float("nan"), 0.0, 0.0, 0.004))
ANSWER = HiddenView(
    HideRequest(), "node_01", 1234, ROWS, dict.fromkeys(("measured", "hidden", "ours", "nearest"), PICTURE)
)


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


class Hide:
    """The folder, what it asked for and what is drawn of it."""

    def __init__(self, scene):
        ui, self.asked = ui_of(scene), []
        self.gui, self.scene = ui.gui, scene
        self.folder = HideFolder(ui, self.asked.append)
        self.folder.clear()

    @property
    def painted(self):
        """How many points are drawn as painted; None without a cloud of them."""
        handle = self.scene.get_handle_by_name("/depth/painted")
        return None if handle is None else len(handle.points)


@pytest.fixture
def hide(server):
    return Hide(server.scene)


def test_the_sliders_say_in_percent_what_is_hidden(hide):
    disc = Disc(0.25, 0.4, 0.1)
    hide.folder.set(HideRequest(3, (Disc(), disc)))
    sliders = ("Centre x (%)", "Centre y (%)", "Diameter (%)")
    assert [hide.gui.find(label).value for label in sliders] == [25, 40, 10]
    assert hide.asked == [HideRequest(0, (Disc(), disc))]
    assert WAITING in hide.gui.text()
    hide.gui.press("Discs", "Add")
    assert hide.folder.discs == (Disc(), disc, disc)


def test_the_button_hides_the_disc_of_the_sliders_if_nothing_is_painted(hide):
    hide.gui.press(BUTTON)
    hide.gui.press(BUTTON)
    assert hide.asked == [HideRequest(0, (Disc(),)), HideRequest(0, (Disc(),))]


def test_clicks_with_the_brush_paint_where_the_point_is_seen(hide):
    folder, gui = hide.folder, hide.gui
    folder.show(WALL, np.eye(4))
    folder.clicked(np.array([0.4, 0.2, 0.0]), FORWARD)
    assert folder.discs == ()
    gui.set("Brush", True)
    gui.set("Diameter (%)", 10.0)
    folder.clicked(np.array([0.4, 0.2, 0.0]), FORWARD)
    folder.clicked(np.array([-0.4, 0.0, 0.0]), FORWARD)
    assert folder.discs == (Disc(70 / 80, 30 / 40, 0.1), Disc(10 / 80, 20 / 40, 0.1))
    assert hide.painted == 2
    assert painted_line(folder.discs) in gui.text()
    gui.press("Discs", "Undo")
    assert hide.painted == 1
    gui.press("Discs", "Clear")
    assert hide.painted is None
    assert "painted in magenta" not in gui.text()


def test_a_click_beside_the_cloud_says_so_and_paints_nothing(hide):
    hide.folder.show(WALL, np.eye(4))
    hide.gui.set("Brush", True)
    hide.folder.clicked(np.array([0.0, 1.0, 0.0]), FORWARD)
    assert hide.folder.discs == ()
    assert NO_POINT in hide.gui.text()
    assert hide.painted is None


def test_another_disc_makes_the_answer_out_of_date(hide):
    hide.gui.press("Discs", "Add")
    hide.folder.load(ANSWER)
    hide.gui.press("Discs", "Add")
    assert not hide.gui.all("image")
    assert "2 discs painted in magenta" in hide.gui.text()


def test_the_answer_is_shown_and_forgotten_with_other_settings(hide):
    hide.folder.load(ANSWER)
    assert "1,234 measured pixels of node_01" in hide.gui.text()
    assert hide.gui.all("image")
    sides = [hide.gui.find(side).value for side in ("Left", "Right")]
    assert sides == [FILLS["hidden"], FILLS["ours"]]
    hide.folder.forget()
    assert not hide.gui.all("image")
    assert "1,234" not in hide.gui.text()
    hide.folder.load(None)
    assert NO_RESULT in hide.gui.text()


def test_the_table_has_every_way_with_its_errors():
    text = fills_table(ANSWER)
    assert all(
        part in text
        for part in (FILLS["ours"], FILLS["nearest"], "0.031", "81 %", "100 %", "200 ms", "–", "0 %")
    )


class Model:
    """The folder of the depth model, and what it asked for."""

    def __init__(self, folder):
        ui, self.asked = ui_of(), []
        self.gui, self.folder = ui.gui, ModelFolder(ui, folder, self.asked.append)

    def upload(self, name, content=b"onnx"):
        self.gui.upload("Add an ONNX file …", name, content)

    @property
    def asks_for_input(self):
        """Whether the input of the network can be set."""
        return self.gui.find("Size (px)").seen


@pytest.fixture
def model(tmp_path):
    return Model(tmp_path)


def test_a_preset_and_a_kind_are_chosen_with_the_file(model):
    model.gui.set("Preset", "midas-small")
    model.gui.set("Output", "inverse")
    model.gui.set("Preset", AS_IN_FILE)
    assert model.asked == [
        ModelChoice(None, "midas-small"),
        ModelChoice(None, "midas-small", "inverse"),
        ModelChoice(None, None, "inverse"),
    ]


def test_an_upload_is_kept_in_the_folder_listed_and_tried(model, tmp_path):
    model.upload("mine.onnx", b"1")
    model.upload("../mine.onnx", b"2")
    paths = [Path(choice.model) for choice in model.asked]
    assert [path.read_bytes() for path in paths] == [b"1", b"2"]
    assert [path.name for path in paths] == ["mine.onnx", "mine.onnx"]
    assert {path.parent.parent for path in paths} == {tmp_path}
    assert model.gui.find("Network file").options == (SHIPPED, "mine.onnx", "mine.onnx′")
    model.gui.set("Network file", SHIPPED)
    assert model.asked[-1] == ModelChoice()


def test_a_huge_upload_is_one_sentence_and_not_kept(model, tmp_path):
    content = type("Huge", (), {"__len__": lambda self: LIMIT_BYTES + 1})()
    with pytest.raises(InputError, match=r"big\.onnx has 128 MB; the app takes up to 128 MB"):
        model.upload("big.onnx", content)
    assert model.asked == []
    assert not list(tmp_path.iterdir())


def test_what_cannot_be_used_waits_for_what_it_expects(model):
    model.folder.write(DepthConfig())
    model.upload("odd.onnx")
    model.folder.load(None)
    assert "previous network stays" in model.gui.text()
    assert model.gui.find("Network file").value == "odd.onnx"
    model.gui.set("Preset", "midas-small")
    assert model.asked[-1] == ModelChoice(model.asked[0].model, "midas-small")
    model.folder.write(DepthConfig())
    assert [model.gui.find(label).value for label in ("Network file", "Preset")] == [SHIPPED, AS_IN_FILE]


def test_only_of_a_foreign_network_the_input_can_be_set(model):
    assert not model.asks_for_input
    model.upload("odd.onnx")
    assert model.asks_for_input
    model.gui.set("Size (px)", (384.0, 256.0))
    model.gui.set("Pixel values", "unit")
    model.gui.press("Use this input")
    assert model.asked[-1] == ModelChoice(model.asked[0].model, None, None, 384, 256, "unit")
    model.gui.set("Network file", SHIPPED)
    assert model.asked[-1] == ModelChoice()
    assert not model.asks_for_input


def test_a_network_from_the_command_line_is_listed_by_its_name(model):
    model.folder.write(DepthConfig("/somewhere/other.onnx", "monodepth2", "inverse", 640, 192, "unit"))
    shown = {
        "Network file": "other.onnx",
        "Preset": "monodepth2",
        "Output": "inverse",
        "Size (px)": (640.0, 192.0),
        "Pixel values": "unit",
    }
    assert {label: model.gui.find(label).value for label in shown} == shown
    assert model.asks_for_input


def test_the_network_tells_what_it_is(model):
    view = ModelView(ModelChoice(), "inverse", "CPUExecutionProvider", 0.023, 5_000_000, {"licence": "MIT"})
    model.folder.load(view)
    assert "linear fit of 1/depth" in model.gui.text()
    for part in ("inverse depth", "CPUExecutionProvider", "23 ms", "5.0 MB", "licence", "MIT"):
        assert part in model.gui.text()


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
