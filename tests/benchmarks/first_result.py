"""How long after ``packetmesh serve`` begins what a person sees stands in the browser.

``python -m tests.benchmarks.first_result`` starts the server as a process of its own, opens Chromium on it as
soon as it answers, and prints, from the start of the server, when the panels are there, the first scene is
drawn, its surface after fusion is, and all numbers are there: the median of several starts, after one that
keeps the bytecode as ``make run`` does. Chromium draws in software, on the same cores; with ``--undrawn``
nothing is drawn, as if a graphics card did all of it.
"""

from __future__ import annotations

import argparse
import contextlib
import os
import socket
import statistics
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import urlsplit

from playwright.sync_api import Page, sync_playwright
from websockets.exceptions import InvalidStatus

from app.load.connection import Connection, wait_for
from app.window.stepper import MARKS
from tests.browser.conftest import ARGUMENTS, chromium_path

PATIENCE_MS = 300_000
MOMENTS = {
    "panels": "button:has-text('Surface')",
    "scene": "role=button[name='Scene ✓']",
    "surface": "text=Rays without a surface",
    "all numbers": "role=button[name='Surface ✓']",
    "up to date": "text=Up to date",
}
"""What is looked for, by what it shows."""


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--scene", default="living-room")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--undrawn", action="store_true", help="do not draw")
    args = parser.parse_args()
    look = hear if args.undrawn else see
    runs = [look(args.scene) for _ in range(1 + args.rounds)][1:]
    for name in runs[0]:
        seconds = [run[name] for run in runs]
        print(f"{name:<12} {statistics.median(seconds):5.1f} s   {' '.join(f'{one:.1f}' for one in seconds)}")


def see(scene: str) -> dict[str, float]:
    """Seconds from the start of one server until each of ``MOMENTS`` stands in Chromium."""
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium_path(), args=ARGUMENTS)
        page = browser.new_context(viewport={"width": 1280, "height": 720}).new_page()
        page.set_default_timeout(PATIENCE_MS)
        with contextlib.closing(browser), served(scene) as (url, began_s):
            _open(page, f"{url}/?screen=surface")
            seconds = {"served": time.monotonic() - began_s}
            for name, selector in MOMENTS.items():
                page.locator(selector).first.wait_for()
                seconds[name] = time.monotonic() - began_s
    return seconds


def hear(scene: str) -> dict[str, float]:
    """The same, as far as it can tell, of a connection that is told all that a page is and draws nothing."""
    with served(scene) as (url, began_s), contextlib.closing(_connected(url)) as page:
        seconds = {"served": time.monotonic() - began_s}
        moments = {
            "panels": lambda: bool(page.steps),
            "scene": lambda: page.mark("Scene") == MARKS["fresh"],
            "all numbers": lambda: page.mark("Surface") == MARKS["fresh"],
        }
        for name, happened in moments.items():
            wait_for(happened, PATIENCE_MS / 1000)
            seconds[name] = time.monotonic() - began_s
    return seconds


@contextlib.contextmanager
def served(scene: str) -> Iterator[tuple[str, float]]:
    """A server that starts now: its address, and when that was."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    program = Path(sys.executable).with_name("packetmesh")
    kept = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    began_s = time.monotonic()
    server = subprocess.Popen(
        [program, "serve", "--scene", scene, "--port", str(port)],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        env=kept,
    )
    try:
        yield f"http://127.0.0.1:{port}", began_s
    finally:
        server.terminate()
        server.wait()


def _open(page: Page, url: str) -> None:
    """Load the page as soon as somebody answers, as ``make run`` does: every page that says that nobody does
    would take a browser's time.
    """
    address = urlsplit(url)
    while True:
        with contextlib.suppress(OSError), socket.create_connection((address.hostname, address.port)):
            break
        time.sleep(0.05)
    page.goto(url, wait_until="commit")


def _connected(url: str) -> Connection:
    """To the server, as soon as it answers."""
    while True:
        try:
            return Connection(url)
        except (OSError, InvalidStatus):  # it does not listen, or lets nobody in yet
            time.sleep(0.05)


if __name__ == "__main__":
    main()
