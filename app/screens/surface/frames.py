"""Slider for the number of frames that are averaged, for a recording whose camera is at rest."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from app.compute.records import AveragedView
from app.web.markup import Markup
from app.window.panel import PanelSession
from app.window.tables import number
from pipeline.config import MOST_AVERAGED, PipelineConfig
from pipeline.sources import Source

QUIET_S = 0.2
"""Time without a change after which the slider counts as at rest, seconds."""
HINT = (
    "Frames of the camera at rest, from the first one, whose depth is averaged pixel by pixel. More frames "
    "measure pixels that flicker, and lower the noise. The ball follows the points: where they become denser "
    "it becomes smaller, so fewer pixels without depth are not always fewer holes."
)


class FramesSlider:
    """The slider, and below it the pixels without depth for every number of frames that was tried."""

    def __init__(self, session: PanelSession) -> None:
        """Add the controls to the current container; they are hidden until ``show`` gets an average."""
        ui = session.ui
        self._session = session
        self._slider = ui.gui.add_slider(
            "Frames", 1, MOST_AVERAGED, 1, session.spec.config.recording.frames, hint=HINT, visible=False
        )
        self._text = ui.gui.add_html(Markup(""), visible=False)
        self._source: Source | None = None
        self._tried: dict[int, AveragedView] = {}
        self._rest = ui.debounce(QUIET_S, self._rested)
        ui.when_changed(self._slider, self._rest.restart)

    def show(self, view: AveragedView | None) -> None:
        """Show the result of averaging a number of frames; None hides the slider."""
        self._slider.visible = self._text.visible = view is not None
        if view is None:
            return
        if self._source != self._session.spec.source:
            self._source, self._tried = self._session.spec.source, {}
        self._tried[view.frames] = view
        self._slider.max = view.available
        self.write(self._session.spec.config)
        self._text.content = frames_html(view, self._tried)

    def write(self, config: PipelineConfig) -> None:
        """Show the setting, unless the slider has just been dragged."""
        if not self._rest.pending:
            self._slider.value = min(config.recording.frames, int(self._slider.max))

    def _rested(self) -> None:
        frames = int(self._slider.value)
        self._session.edit(lambda config: replace(config, recording=replace(config.recording, frames=frames)))


def frames_html(view: AveragedView, tried: Mapping[int, AveragedView]) -> Markup:
    """Return the numbers of an average, and the pixels without depth for all numbers of frames tried."""
    text = Markup(
        "<b>{}</b> of the pixels have no depth with {} frame{}; noise {:.1f} mm (median); {} moved, "
        "{} flicker."
    ).format(
        _percent(view.unmeasured_share),
        view.frames,
        "s" * (view.frames != 1),
        1000.0 * view.median_sd_m,
        _percent(view.moving_share),
        _percent(view.flickering_share),
    )
    if len(tried) > 1:
        shares = ", ".join(
            f"{_percent(tried[frames].unmeasured_share)} with {frames}" for frames in sorted(tried)
        )
        text += Markup(" Tried: {}.").format(shares)
    return Markup("<div style='padding: 0 0.8em; font-size: 13px'>{}</div>").format(text)


def _percent(share: float) -> str:
    return number(share, 1, "%", 100.0)
