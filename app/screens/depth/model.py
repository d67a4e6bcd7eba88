"""The panel folder that chooses the depth network: the one that ships, or an uploaded one."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import viser

from app.screens.depth.labels import AS_IN_FILE, NETWORK_KINDS, NETWORK_PRESETS, NORMALISATIONS
from app.screens.depth.view import ModelChoice, ModelView
from app.web.markup import Markdown, Markup
from app.web.uploads import OWN, keep_upload
from app.window.tables import number, table
from app.window.ui import Ui
from pipeline.config import DepthConfig, ModelKind

SHIPPED = "the network that ships"
LIMIT_BYTES = 128 << 20
TEXT = Markdown(
    """Any ONNX network that infers depth from one image can be used. The app reads its input (size,
colours) and its output (metric, relative or inverse depth) from the file, or takes them from a preset.
A network that takes **image and depth** (such as LingBot-Depth) is recognised by its inputs: it completes
the sensor's depth instead of ours."""
)
ADVICE: dict[ModelKind, Markdown] = {
    "metric": Markdown("Its output is in metres: try the alignments *none* and *one scale*."),
    "relative": Markdown(""),
    "inverse": Markdown("Its output is 1/depth: the smooth correction starts from a linear fit of 1/depth."),
}
COMPLETES = Markdown(
    "It takes image and depth and fills the sensor's holes. Hide a part of the depth with the brush above to "
    "compare it with the completion that ships."
)
TRYING = Markdown("Trying the network …")
KEPT = Markdown("The previous network stays in use. Set the input of this one, or choose another.")


class ModelFolder:
    """A list of networks, an upload button, a preset, and the description in the network's file."""

    def __init__(self, ui: Ui, folder: Path, on_choose: Callable[[ModelChoice], None]) -> None:
        """Add the controls; uploaded files are kept in ``folder``."""
        self._folder, self._on_choose = folder, on_choose
        self._models: dict[str, str | None] = {SHIPPED: None}
        gui = ui.gui
        with gui.add_folder("Neural network", expand_by_default=False):
            gui.add_markdown(TEXT)
            self._model = gui.add_dropdown(
                "Network file", [SHIPPED], hint="Network that infers or completes the depth."
            )
            self._preset = gui.add_dropdown(
                "Preset",
                list(NETWORK_PRESETS),
                hint="Input size, colours and kind of output, for a network whose file does not state them.",
            )
            self._kind = gui.add_dropdown(
                "Output",
                list(NETWORK_KINDS),
                hint="Meaning of the network's output. metric: metres; relative: depth up to a scale; "
                "inverse: 1/depth up to scale and shift, as of MiDaS and Depth Anything.",
            )
            ui.when_changed(self._model, self._picked)
            for handle in (self._preset, self._kind):
                ui.when_changed(handle, self._chosen)
            button = gui.add_upload_button(
                "Add an ONNX file …", icon=viser.Icon.UPLOAD, mime_type=".onnx", hint="At most 128 MB."
            )
            button.on_upload(lambda event: ui.post(self._keep, event.target.value))
            self._add_input(ui)
            self._status = gui.add_markdown(Markdown(""))
            self._table = gui.add_html(Markup(""))

    def _add_input(self, ui: Ui) -> None:
        """Add the input settings of an uploaded network."""
        gui = ui.gui
        self._advanced = gui.add_folder("Advanced: its input", expand_by_default=False, visible=False)
        with self._advanced:
            self._size = gui.add_vector2(
                "Size (px)",
                (0.0, 0.0),
                min=(0.0, 0.0),
                step=1.0,
                hint="Width and height of its input, if the file leaves them open; 0 and 0: from the file.",
            )
            self._normalisation = gui.add_dropdown(
                "Pixel values",
                list(NORMALISATIONS),
                hint="imagenet: with ImageNet's mean and deviation; unit: from 0 to 1; bytes: from 0 to 255.",
            )
            gui.add_button("Use this input", icon=viser.Icon.CHECK, hint="Runs the network again.").on_click(
                lambda _: ui.post(self._chosen)
            )

    def write(self, config: DepthConfig) -> None:
        """Show the network of these settings."""
        own = config.completion or config.model
        name = next((name for name, path in self._models.items() if path == own), None)
        if name is None:
            name = self._add(Path(str(own)).name, str(own))
        self._model.value = name
        self._preset.value = config.preset or AS_IN_FILE
        self._kind.value = config.model_kind or AS_IN_FILE
        self._size.value = (float(config.input_width_px or 0), float(config.input_height_px or 0))
        self._normalisation.value = config.completion_normalisation or config.normalisation or AS_IN_FILE
        self._advanced.visible = own is not None

    def load(self, view: ModelView | None) -> None:
        """Show the result of trying a network; None if it could not be used and the previous one stays."""
        if view is None:
            self._status.content = KEPT
            return
        self._status.content = COMPLETES if view.choice.completion is not None else ADVICE[view.kind]
        self._table.content = model_table(view)

    def _picked(self) -> None:
        """Try another file, with the input size and normalisation that the file itself states."""
        self._size.value, self._normalisation.value = (0.0, 0.0), AS_IN_FILE
        self._chosen()

    def _chosen(self) -> None:
        self._status.content, self._table.content = TRYING, Markup("")
        model = self._models[self._model.value]
        self._advanced.visible = model is not None
        width_px, height_px = (round(side) or None for side in self._size.value)
        self._on_choose(
            ModelChoice(
                model,
                NETWORK_PRESETS[self._preset.value],
                NETWORK_KINDS[self._kind.value],
                width_px,
                height_px,
                NORMALISATIONS[self._normalisation.value],
            )
        )

    def _keep(self, file: viser.UploadedFile) -> None:
        instead = "name larger networks with depth.model or depth.completion on the command line"
        path = keep_upload(file, self._folder / f"{OWN}{len(self._models)}", LIMIT_BYTES, instead)
        self._model.value = self._add(Path(file.name).name, str(path))
        self._picked()

    def _add(self, name: str, path: str) -> str:
        """Add a file to the list under a unique name."""
        while name in self._models:
            name += "′"
        self._models[name] = path
        self._model.options = tuple(self._models)
        return name


def model_table(view: ModelView) -> Markup:
    """Return a table in HTML with the results of the trial and the metadata of the file."""
    rows = [
        (
            "Input",
            "What the network takes.",
            "image" if view.choice.completion is None else "image and depth",
        ),
        ("Output", "Meaning of its output.", f"{view.kind} depth"),
        ("Provider", "The execution provider that onnxruntime really used.", view.provider),
        (
            "First picture",
            "Computing time of the first picture; later ones are faster.",
            number(view.inference_s, 0, "ms", 1000.0),
        ),
        ("File", "Size of the file.", number(view.size_bytes, 1, "MB", 1e-6)),
    ]
    rows += [(key, "From the file's own metadata.", text) for key, text in view.description.items()]
    return table(rows)
