"""The folder that replays the thesis's robustness experiment."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from app.dock.plots import PlotDock
from app.screens.calibrate.noise_view import CLOSE, NoiseView
from app.screens.calibrate.scatter import MORE, noise_sheet
from app.web.markup import Markdown
from app.window.ui import Ui

TEXT = Markdown(
    """How much do noisier points change the calibration? The app takes the calibration above as the
**truth**, adds this noise to every point of its views, and estimates the camera again, 200 times; the
scatter is shown at the lower edge of the window. Table 4.1 of the thesis has one value for each noise
level."""
)
THIS, OTHER = "this lens", f"this lens with {MORE}"
READY = Markdown("Drag the slider to start.")
STOPPED = Markdown("Stopped or failed. Drag the slider to start again.")
REST_S = 0.25
"""Time that the slider must be still before the experiment starts, seconds."""


class NoiseFolder:
    """A slider and a sentence; the growing scatter of the trials is in the dock."""

    def __init__(
        self, ui: Ui, on_replay: Callable[[int, float, bool], None], on_stop: Callable[[], None]
    ) -> None:
        """Add the folder.

        Args:
            ui: panel to add it to.
            on_replay: called with the number of the replay, which its results have to name, the noise in
                px, and whether a lens with more distortion projects the points.
            on_stop: called to stop the running replay.
        """
        self._on_replay, self._on_stop = on_replay, on_stop
        self._view: NoiseView | None = None
        self._replay = 0
        """Number of the last replay; late results of earlier ones are ignored."""
        self._running = False
        """Whether the last replay has yet to end."""
        gui = ui.gui
        self._resting = ui.debounce(REST_S, self._rested)
        self._folder = gui.add_folder("What if the points were noisier?", expand_by_default=False)
        with self._folder:
            gui.add_markdown(TEXT)
            self._sigma = gui.add_slider(
                "Noise (px)",
                0.0,
                1.0,
                0.05,
                0.5,
                hint="Standard deviation added to the column and the row of every point.",
            )
            ui.when_changed(self._sigma, self._moved)
            self._through = gui.add_dropdown(
                "Seen through",
                [THIS, OTHER],
                hint="Lens that projects the points: the estimated one, or the same with more distortion, "
                "which the lens model *thesis* cannot describe; not for a fisheye.",
            )
            ui.when_changed(self._through, self._moved)
            ui.buttons(
                "Experiment",
                {"Replay": self._rested, "Stop": self.stop},
                "Replay: start again with this noise. Stop: stop and keep the trials so far.",
            )
            self._status = gui.add_markdown(READY)
        self._dock = PlotDock(ui)

    def show(self, visible: bool) -> None:
        """Show or hide the scatter."""
        self._dock.show(visible)

    def set(self, sigma_px: float, other_lens: bool) -> None:
        """Set the noise and start."""
        self._sigma.value, self._through.value = sigma_px, OTHER if other_lens else THIS
        self._rested()

    def forget(self) -> None:
        """Remove the replay, which belongs to another camera or other views."""
        if self._running:
            self._on_stop()
        self._view, self._running = None, False
        self._replay += 1
        self._dock.load(None)
        self._status.content = READY

    def stop(self) -> None:
        """Stop the replay and keep its trials."""
        self._on_stop()

    def load(self, replay: int, view: NoiseView) -> None:
        """Show the trials of a replay so far."""
        if replay != self._replay or not view.trials:
            return
        self._view = view
        self._dock.load(noise_sheet(view))
        self._status.content = noise_line(view)

    def ended(self, replay: int, view: NoiseView | None) -> None:
        """Handle the end of a replay; ``view`` is None if it was stopped or failed."""
        if replay != self._replay:
            return
        if view is not None:
            self.load(replay, view)
        elif self._view is None:
            self._status.content = STOPPED
        self._running = False

    def _moved(self) -> None:
        """Stop the running replay at once; start when the slider is at rest."""
        if self._running:
            self._on_stop()
        self._resting.restart()

    def _rested(self) -> None:
        self._replay += 1
        self._running, self._view = True, None
        self._status.content = Markdown("Waiting for the first trials …")
        self._dock.begin()
        self._on_replay(self._replay, float(self._sigma.value), self._through.value == OTHER)


def noise_line(view: NoiseView) -> Markdown:
    """Return the experiment's result in some sentences."""
    whole = view.trials >= view.request.trials
    result = Markdown(
        "**{}.** fx, fy, cx and cy are all within {:g} % of the truth in **{:.0f} %** of them. "
        "RMS {:.3f} px; noise alone leaves {:.3f} px at most."
    ).format(
        "All trials" if whole else f"{view.trials} of {view.request.trials} trials",
        100.0 * CLOSE,
        100.0 * view.close_share,
        view.rms_px,
        np.sqrt(2.0) * view.request.sigma_px,
    )
    if not view.halved:
        return result
    beyond = f"{view.beyond_noise} of {view.halved}"
    return Markdown(
        "{} In **{}** trials the two halves of the views differ by more than noise explains."
    ).format(result, beyond)
