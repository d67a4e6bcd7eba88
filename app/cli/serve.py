"""``packetmesh serve``: the app."""

from __future__ import annotations

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
    from app.server import serve as serve_app

    def announce(url: str) -> None:
        say(f"PacketMesh is at {url} (stop with Ctrl-C)")

    serve_app(
        scene=scene,
        config=config_named(preset, PRESETS),
        host=host,
        port=port,
        open_browser=open,
        lecture=lecture,
        announce=announce,
    )
