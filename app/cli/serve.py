"""``packetmesh serve``: the app."""

from __future__ import annotations

import signal
import threading
import webbrowser

from app.cli.options import PresetName
from app.cli.text import say
from packetmesh.settings import config_named
from pipeline.config import PRESETS


def serve(
    scene: str = "living-room",
    preset: PresetName = "packetmesh",
    host: str = "127.0.0.1",
    port: int = 8080,
    open: bool = False,
    lecture: bool = False,
) -> None:
    """Open the app: step through a reconstruction in the browser.

    Args:
        scene: Demo scene to start with (see `packetmesh scenes`), or a rig folder.
        preset: Settings to start with.
        host: Address to listen on; other machines can reach only what is not loopback.
        port: Port to listen on.
        open: Open a browser window.
        lecture: Share one session among all browsers instead of one each.
    """
    from app.server import build_server

    stopped = threading.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: stopped.set())
    app = build_server(scene, config_named(preset, PRESETS), host, port, lecture)
    try:
        say(f"PacketMesh is at {app.url} (stop with Ctrl-C)")
        if open:
            webbrowser.open(app.url)
        stopped.wait()
    finally:
        app.stop()
