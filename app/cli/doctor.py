"""``packetmesh doctor``: checks of this machine, with advice on what is missing."""

from __future__ import annotations

import importlib
import importlib.metadata
import os
import platform
import shutil
import socket
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial

import psutil

from app.cli.text import print_json
from packetmesh.errors import PacketMeshError

PACKAGES = ("numpy", "scipy", "numba", "opencv-python-headless", "onnxruntime", "trimesh", "simpy", "viser")
LINUX_LIBRARIES = "libgl1 libegl1 libx11-6 libidn2-0 libudev1 libgomp1"


@dataclass(frozen=True, slots=True)
class Finding:
    """The result of one check."""

    name: str
    ok: bool
    detail: str


def doctor(json: bool = False) -> None:
    """Report the versions and resources of this machine, and what PacketMesh needs but lacks.

    Args:
        json: Print the findings as one JSON object.
    """
    findings = examine()
    if json:
        print_json({finding.name: {"ok": finding.ok, "detail": finding.detail} for finding in findings})
    else:
        for finding in findings:
            print(f"{'ok ' if finding.ok else 'BAD'} {finding.name:<14} {finding.detail}")
    bad = [finding.name for finding in findings if not finding.ok]
    if bad:
        raise PacketMeshError(f"These checks failed: {', '.join(bad)} (see above)")


def examine() -> list[Finding]:
    """Check everything that the program needs; a failed check is a finding, not an error."""
    return [
        finding
        for look in (_python, _machine, _packages, _open3d, _network, _scenes, _port, _browser)
        for finding in look()
    ]


def _finding_of(name: str, look: Callable[[], str], advice: str) -> Finding:
    try:
        return Finding(name, True, look())
    except Exception as error:
        return Finding(name, False, f"{str(error).splitlines()[0] if str(error) else error!r}; {advice}")


def _python() -> Iterator[Finding]:
    ok = (3, 11) <= sys.version_info[:2] <= (3, 13)
    yield Finding("python", ok, platform.python_version() + ("" if ok else "; PacketMesh needs 3.11 to 3.13"))


def _machine() -> Iterator[Finding]:
    memory_gb = psutil.virtual_memory().total / 1e9
    detail = f"{os.cpu_count()} cores, {memory_gb:.1f} GB of memory, {platform.system()} {platform.machine()}"
    yield Finding("machine", memory_gb > 3, detail + ("" if memory_gb > 3 else "; the app needs 3 GB"))


def _packages() -> Iterator[Finding]:
    for name in PACKAGES:
        yield _finding_of(name, partial(importlib.metadata.version, name), "run make again to install it")


def _open3d() -> Iterator[Finding]:
    advice = f"on Debian or Ubuntu: apt-get install {LINUX_LIBRARIES}"
    yield _finding_of(
        "open3d", lambda: importlib.import_module("pipeline.kernels.open3d_runtime").o3d.__version__, advice
    )


def _network() -> Iterator[Finding]:
    def look() -> str:
        from pipeline.depth import DepthNetwork

        network = DepthNetwork()
        return f"{network.model_path.name} runs on {network.provider}"

    yield _finding_of("depth network", look, "restore assets/depth from the repository")


def _scenes() -> Iterator[Finding]:
    def look() -> str:
        from pipeline.importing.recorded import open_recording
        from pipeline.io.demos import DEMO_SCENES, DEMO_WALKS, DEMOS, RECORDINGS, load_demo

        nodes = sum(len(load_demo(name).frames) for name in DEMO_SCENES)
        frames = sum(len(open_recording(RECORDINGS / name).times_s) for name in DEMO_WALKS)
        return f"{len(DEMOS)} demos, {nodes} nodes, {frames} frames of walks"

    yield _finding_of("scenes", look, "restore assets from the repository")


def _port() -> Iterator[Finding]:
    with socket.socket() as probe:
        free = probe.connect_ex(("127.0.0.1", 8080)) != 0
    yield Finding("port 8080", True, "free" if free else "in use; start the app with --port 8081")


def _browser() -> Iterator[Finding]:
    found = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
    yield Finding(
        "test browser",
        True,
        found or "no Chromium: the browser tests will be skipped; apt-get install chromium",
    )
