"""``packetmesh serve``: the app."""

from __future__ import annotations

import signal
import time
import webbrowser
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from app.cli.options import PresetName
from app.cli.text import say
from packetmesh.settings import config_named
from pipeline.config import PRESETS

if TYPE_CHECKING:
    from app.lessons import OwnLesson

HostNames = Annotated[
    tuple[str, ...], tyro.conf.UseAppendAction, tyro.conf.arg(name="allow-host", metavar="NAME")
]
Lessons = Annotated[tuple[Path, ...], tyro.conf.UseAppendAction, tyro.conf.arg(name="lesson", metavar="FILE")]
CHECK_S = 0.2
"""Time between two checks for a signal to stop, seconds."""
ALONE = ", from this machine only; --host 0.0.0.0 admits other machines"


def serve(
    scene: str = "living-room",
    preset: PresetName = "packetmesh",
    host: str = "127.0.0.1",
    port: int = 8080,
    open: bool = False,
    lecture: bool = False,
    no_token: bool = False,
    allow_host: HostNames = (),
    lessons: Lessons = (),
) -> None:
    """Open the app: step through a reconstruction in the browser.

    Args:
        scene: Demo scene to start with (see `packetmesh scenes`), a rig folder, or a recording.
        preset: Settings to start with.
        host: Address to listen on; other machines can connect only if it is not a loopback address.
        port: Port to listen on.
        open: Open a browser window.
        lecture: Share one session among all browsers: the browser with the teacher's link controls it, the
            class follows, votes and looks around.
        no_token: With another --host: admit everyone who can reach the address, not only those with the
            printed link.
        allow_host: Further name of this server, with any port, for example lab.example.org of a proxy in
            front of it.
        lessons: A lesson of your own (my-lesson.md), or a folder of them; `packetmesh lesson check` finds
            their faults, docs/using.md describes the format.
    """
    from app.compute.jobs import start_pool

    config = config_named(preset, PRESETS)
    own: tuple[OwnLesson, ...] = ()
    if lessons:
        from app.lessons import own_lessons

        own = tuple(own_lessons(lessons))
    stops = list[int]()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda number, _: stops.append(number))
    pool = start_pool()  # imports while this process imports
    try:
        from app.server import build_server
        from app.web.entrance import is_loopback

        app = build_server(
            scene, config, host, port, lecture, not no_token, pool, allow_host, own, ahead=True
        )
    except BaseException:
        pool.close()
        raise
    try:
        if lecture:
            say(f"Teacher's link: {app.teacher_url} (keep it secret; stop with Ctrl-C)")
            say(f"Link for the class: {app.class_link}" + ALONE * is_loopback(host))
        else:
            say(f"PacketMesh is at {app.link if is_loopback(host) else app.class_link} (stop with Ctrl-C)")
        if app.entrance.visitor is not None:
            say(
                "Only someone with this link can connect. Traffic is not encrypted, so use a network "
                "that you trust"
            )
        elif not is_loopback(host):
            say("Anyone who can reach this address can connect")
        if allow_host and app.entrance.visitor is None:
            say(f"Anyone who can reach it as {' or '.join(allow_host)} can connect")
        if open:
            webbrowser.open(app.teacher_url if lecture else app.link)
        while not stops:  # an endless wait would miss a signal that another thread gets
            time.sleep(CHECK_S)
    finally:
        app.stop()
