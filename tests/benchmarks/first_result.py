"""How long after ``packetmesh serve`` begins what a person sees stands in the browser.

``python -m tests.benchmarks.first_result`` starts the server as a process of its own, opens Chromium on it as
soon as it answers, and prints, from the start of the server, when the panels are there, the first scene is
drawn, its surface is measured, and all of the chain is up to date: the median of several starts, after one
that keeps the bytecode as ``make run`` does.
"""

from __future__ import annotations

import argparse
import os
import socket
import statistics
import subprocess
import sys
import time
from pathlib import Path

from playwright.sync_api import Error, Page, sync_playwright

from tests.browser.conftest import ARGUMENTS, chromium_path

PATIENCE_MS = 300_000
MOMENTS = {
    "panels": "button:has-text('Surface')",
    "scene": "button:has-text('Scene ✓')",
    "surface": "button:has-text('Surface ✓')",
    "up to date": "text=Up to date",
}
"""What is looked for, by what it shows."""


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--scene", default="living-room")
    parser.add_argument("--rounds", type=int, default=3)
    args = parser.parse_args()
    runs = [start(args.scene) for _ in range(1 + args.rounds)][1:]
    for name in runs[0]:
        seconds = [run[name] for run in runs]
        print(f"{name:<12} {statistics.median(seconds):5.1f} s   {' '.join(f'{one:.1f}' for one in seconds)}")


def start(scene: str) -> dict[str, float]:
    """Seconds from the start of one server until each of ``MOMENTS``."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium_path(), args=ARGUMENTS)
        page = browser.new_context(viewport={"width": 1280, "height": 720}).new_page()
        page.set_default_timeout(PATIENCE_MS)
        began_s = time.monotonic()
        command = [
            Path(sys.executable).with_name("packetmesh"),
            "serve",
            "--scene",
            scene,
            "--port",
            str(port),
        ]
        kept = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
        server = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, env=kept)
        try:
            _open(page, f"http://127.0.0.1:{port}/?screen=surface")
            seconds = {"served": time.monotonic() - began_s}
            for name, selector in MOMENTS.items():
                page.locator(selector).first.wait_for()
                seconds[name] = time.monotonic() - began_s
        finally:
            server.terminate()
            server.wait()
            browser.close()
    return seconds


def _open(page: Page, url: str) -> None:
    """Load the page as soon as somebody answers."""
    while True:
        try:
            page.goto(url, wait_until="commit")
            return
        except Error:
            time.sleep(0.05)


if __name__ == "__main__":
    main()
