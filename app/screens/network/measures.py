"""Measures on the surface that the sink has at the clock's time."""

from __future__ import annotations

from app.measuring.folder import MeasureFolder
from app.screens.network.delivery_view import DeliveryView, MomentView
from app.window.panel import PanelSession

REST_S = 0.6
"""Time that the clock must be still before its surface is measured, seconds."""


class MomentMeasures(MeasureFolder):
    """The folder *Measure* of the Network screen."""

    def __init__(self, session: PanelSession) -> None:
        """Add the folder to the current container."""
        self._moment: MomentView | None = None
        self._index = 0
        """Index of ``_moment`` in its delivery."""
        self._ready = False
        """Whether its surface can be measured."""
        self._resting = session.ui.debounce(REST_S, self._prepare)
        super().__init__(session, "/network/runs/measures", "network.measure_job:measure_job")

    def follow(self, view: DeliveryView | None, moment: MomentView | None) -> None:
        """Measure the surface of another moment once the clock is still; None: measure nothing."""
        if moment is self._moment:
            return
        self._moment, self._ready = moment, False
        self.unload()
        if view is not None and moment is not None:
            self._index = view.times_ns.index(moment.t_ns)
            self._resting.restart()

    def _begin(self) -> None:
        super()._begin()
        self._prepare()

    def _prepare(self) -> None:
        """Request the surface to measure, which takes seconds, if clicks measure or there are measures."""
        moment, index = self._moment, self._index
        if moment is None or not moment.glb or self._ready or not (self._on.value or self._tape.taken):
            return

        def made(done: bool | None) -> None:
            if done and moment is self._moment:
                self._ready = True
                self.load(index)

        self._session.side_job("network.measure_job:prepare_job", index, on_end=made)
