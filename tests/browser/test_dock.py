"""The dock alone in a real browser: what a hand does there reaches the clock."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
import viser

from app.dock import Dock
from app.levels import levels_of
from app.timeline import Curve, CurvesLane, FramesLane
from app.ui import Ui

END_NS = 10_000_000_000


class Stage:
    """Two rows of frames and a curve, and what the dock reported."""

    def __init__(self, client):
        self.thread = ThreadPoolExecutor(1)
        ui = Ui(client.gui, client.scene, self.post, client.atomic, client.flush)
        self.ui, self.moves, self.picks = ui, [], []
        self.folder = client.gui.add_folder(None)
        with self.folder:
            self.dock = Dock(ui, self.moves.append, lambda *what: self.picks.append(what))
        self.post(self.fill)

    def post(self, function, *arguments):
        self.thread.submit(function, *arguments)

    def fill(self):
        starts_ns = np.arange(100) * 100_000_000
        ends_ns = starts_ns + 40_000_000
        row, lost = np.arange(100) % 2, np.arange(100) % 10 == 3
        frames = FramesLane(
            levels_of(starts_ns, ends_ns, row, lost, 2),
            ("porch", "window"),
            "frame {}".format,
            ("", "collision"),
        )
        t_ns = np.linspace(0, END_NS, 11).astype(np.int64)
        curve = Curve("F-score", "", (0, 158, 115), t_ns, np.linspace(0.0, 1.0, 11))
        self.dock.load(0, END_NS, starts_ns, [frames, CurvesLane("Quality", [curve])])
        self.dock.show(True)

    def close(self):
        self.ui.close()
        self.thread.shutdown()


@pytest.fixture(scope="module")
def docks(chromium):
    """A server whose visitors see nothing but a dock."""
    server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    stages = []
    server.on_client_connect(lambda client: stages.append(Stage(client)))
    yield server, stages
    for stage in stages:
        stage.close()
    server.stop()
