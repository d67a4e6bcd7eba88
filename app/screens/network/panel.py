"""Network: nodes send their images by radio; who sends when, what is lost and what it costs."""

from __future__ import annotations

from typing import ClassVar

from app.drawing.clouds import clear
from app.screens.network.charts import NetworkCharts
from app.screens.network.draw import NetworkDrawing, look_at_ground
from app.screens.network.labels import NETWORKS
from app.screens.network.numbers import metric_tables, runs_summary
from app.screens.network.player import NetworkPlayer
from app.screens.network.setup import NetworkSetup
from app.screens.network.view import NetworkRun, NetworkView
from app.ui import Panel

TEXT = """**What you see.** Camera nodes (blue) send their images by radio to a sink or to access points
(green); circles show how far a frame can be received. Every moving point is a frame on the air; a red one
was lost there. Press **Play**, slow down to see single frames, and rest the pointer on the timeline to read
why."""
ORIGIN = """The schemes are our reconstruction: of the paper they come from (Bruno & Nurchis, arXiv 1311.6013)
only the abstract and the first lines could be read."""
REST_S = 0.6
"""How long the settings have to rest before a run begins."""
SHOWN_S = 0.4
"""How long a packet is seen moving at least, and a loss stays, in seconds of the person who looks."""
RUNNING = "Simulating; the bar at the top shows how far. *Cancel* ends it."
CANCELLED = "Cancelled. *Retry* simulates again."
FAILED = "The simulation failed, and a notice said why. Change a setting, or press *Retry*."


class NetworkPanel(Panel):
    """Runs of the camera network on one timeline."""

    title = "Network"
    drawn_below: ClassVar[str] = "/network"

    def build(self) -> None:
        """Settings, player, curves, timeline, numbers."""
        gui = self.gui
        self._views: tuple[NetworkView, ...] = ()
        self._wanted: tuple[NetworkRun, ...] = ()
        self._drawing: NetworkDrawing | None = None
        self._drawn = 0
        self._framed: tuple[float, ...] = ()
        self._cancelled = False
        self._resting = self.ui.debounce(REST_S, self._run)
        gui.add_markdown(TEXT)
        self._setup = NetworkSetup(self.ui, self._resting.restart)
        self._about = gui.add_markdown(NETWORKS[self._setup.preset].sentence)
        self._status = gui.add_markdown("Nothing is simulated yet.")
        self._player = NetworkPlayer(self.ui, self._moved)
        self._charts = NetworkCharts(self.ui, self._player)
        self._table = gui.add_html("")
        with gui.add_folder("All other numbers", expand_by_default=False):
            self._others = gui.add_html("")
        with gui.add_folder("Advanced", expand_by_default=False):
            self._setup.add_advanced()

    def on_show(self) -> None:
        """Simulate at the first visit; turn the view to the network."""
        self._framed = ()
        if not self._wanted:
            self._run()

    def on_action(self, action: str) -> None:
        """Cancel, retry and reset also mean the simulation."""
        if action == "Cancel":
            self._cancelled = True
        elif action == "Retry" and self._wanted and not self._views:
            self._run()
        elif action == "Reset" and self._wanted:
            self._setup.reset()
            self._run()

    def look(self) -> bool:
        """Turn the view to the whole network, once for each shape of the window."""
        if self._drawing is not None:
            clients = list(self.session.clients())
            shape = tuple(round(client.camera.aspect, 1) for client in clients)
            if shape != self._framed:
                look_at_ground(clients, self._drawing.ground)
                self._framed = shape
        return True

    @property
    def command(self) -> str:
        """The command lines that simulate the same."""
        return self._setup.command()

    def _run(self) -> None:
        """Simulate the runs of the controls, unless they are shown already."""
        preset = NETWORKS[self._setup.preset]
        self._about.content = preset.sentence + (f" {ORIGIN}" if preset.schemes else "")
        runs = self._setup.runs()
        if runs == self._wanted and self._views:
            return
        self._wanted, self._cancelled = runs, False
        self._status.content = RUNNING
        self.session.apart_job(
            "simulate", self.session.store, runs, on_end=lambda views: self._ended(runs, views)
        )

    def _ended(self, runs: tuple[NetworkRun, ...], views: tuple[NetworkView, ...] | None) -> None:
        if runs != self._wanted:
            return
        with self.ui.atomic():
            if views is None:
                self._forget()
                self._status.content = CANCELLED if self._cancelled else FAILED
            else:
                self._take(views)
        if views is not None:
            self.session.frame_view()

    def _take(self, views: tuple[NetworkView, ...]) -> None:
        self._views = views
        self._status.content = runs_summary(views)
        self._table.content, self._others.content = metric_tables(views)
        self._drawn += 1
        clear(self.scene, f"{self.drawn_below}/runs")
        self._drawing = NetworkDrawing(self.scene, f"{self.drawn_below}/runs/{self._drawn}", views)
        self._framed = ()
        self._charts.load(views)
        self._player.load_runs(views)

    def _forget(self) -> None:
        """Show nothing: what was there has other settings."""
        self._views, self._drawing = (), None
        self._player.pause()
        self._charts.forget()
        self._table.content = self._others.content = ""
        clear(self.scene, f"{self.drawn_below}/runs")

    def _moved(self) -> None:
        if self._drawing is None:
            return
        now_ns = self._player.now_ns
        with self.ui.atomic():
            self._drawing.show(now_ns, round(SHOWN_S * self._player.seconds_a_second * 1e9))
            self._charts.mark(now_ns)
