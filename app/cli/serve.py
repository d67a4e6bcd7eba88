"""``packetmesh serve``: the app."""

from __future__ import annotations

import signal
import time
import webbrowser

from app.cli.options import PresetName
from app.cli.text import say
from packetmesh.settings import config_named
from pipeline.config import PRESETS

HEED_S = 0.2
"""Time between two checks for a signal to stop."""
ALONE = ", from this machine only; --host 0.0.0.0 lets others in"


def serve(
    scene: str = "living-room",
    preset: PresetName = "packetmesh",
    host: str = "127.0.0.1",
    port: int = 8080,
    open: bool = False,
    lecture: bool = False,
    no_token: bool = False,
) -> None:
    """Open the app: step through a reconstruction in the browser.

    Args:
        scene: Demo scene to start with (see `packetmesh scenes`), or a rig folder.
        preset: Settings to start with.
        host: Address to listen on; other machines can reach only what is not loopback.
        port: Port to listen on.
        open: Open a browser window.
        lecture: Share one session among all browsers: who has the teacher's link steers, the class follows,
            votes and looks around.
        no_token: With another --host: let in whoever reaches it, not only who has the link that is printed.
    """
    from app.compute.jobs import start_pool

    config = config_named(preset, PRESETS)
    stops = list[int]()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda number, _: stops.append(number))
    pool = start_pool()  # imports while this process imports
    try:
        from app.server import build_server
        from app.web.entrance import is_loopback

        app = build_server(scene, config, host, port, lecture, not no_token, pool=pool)
    except BaseException:
        pool.close()
        raise
    try:
        if lecture:
            say(f"You teach at {app.teacher_url} (keep it to yourself; stop with Ctrl-C)")
            say(f"The class comes to {app.class_link}" + ALONE * is_loopback(host))
        else:
            say(f"PacketMesh is at {app.link if is_loopback(host) else app.class_link} (stop with Ctrl-C)")
        if app.entrance.visitor is not None:
            say("Only who has this link comes in: it is not encrypted, so keep to a network that you trust")
        elif not is_loopback(host):
            say("Whoever reaches this address comes in")
        if open:
            webbrowser.open(app.teacher_url if lecture else app.link)
        while not stops:  # an endless wait would miss a signal that another thread gets
            time.sleep(HEED_S)
    finally:
        app.stop()
