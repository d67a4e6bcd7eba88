"""``python -m app.compute.prepared``: compute the results that a new server shows first, for all servers.

The results are stored in the Python environment (``FOLDER``), in a folder named by the hash of everything
that they depend on. After any change of code, assets or packages a server finds no folder of its hash and
computes the results itself. They are pickles, which can run code when they are read; but a user who can write
them can also change the installed packages. A damaged file has a wrong checksum and counts as missing.
"""

from __future__ import annotations

import hashlib
import os
import shutil
import sys
import sysconfig
import tempfile
from contextlib import suppress
from pathlib import Path

from app.compute import jobs
from app.compute.state import CHAIN, Spec
from app.compute.store import Store
from packetmesh.progress import drain
from pipeline.io.demos import DEMO_SCENES
from pipeline.sources import Demo

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = ("app", "assets", "network_sim", "packetmesh", "pipeline")
FOLDER = Path(sys.prefix, "var", "packetmesh")


def prepare() -> None:
    """Compute the chain of the first scene with the default settings, unless it is done; delete old results.

    Raises:
        OSError: the folder cannot be written.
    """
    FOLDER.mkdir(parents=True, exist_ok=True)
    now = FOLDER / fingerprint()
    if now.exists():
        return
    for earlier in FOLDER.iterdir():
        shutil.rmtree(earlier, ignore_errors=True)
    unfinished = tempfile.mkdtemp(dir=FOLDER)  # for this user only
    store, spec = Store(unfinished), Spec(Demo(next(iter(DEMO_SCENES))))
    for step in CHAIN:
        drain(jobs.run_step(step, store, spec))
    Path(unfinished).rename(now)


def take_prepared(folder: Path) -> None:
    """Put the prepared results of the same code and packages, if there are any, into a server's store."""
    with suppress(OSError):
        for path in (FOLDER / fingerprint()).iterdir():
            try:
                os.link(path, folder / path.name)
            except OSError:  # on another disk
                shutil.copyfile(path, folder / path.name)


def fingerprint() -> str:
    """Return a hash of all that the results depend on: our files, and the versions of Python and packages."""
    summed = hashlib.sha256(sys.version.encode())
    installed = (path.name for path in Path(sysconfig.get_path("purelib")).glob("*.dist-info"))
    summed.update("\n".join(sorted(installed)).encode())
    for package in PACKAGES:
        for path in sorted((ROOT / package).rglob("*")):
            if path.is_file() and "__pycache__" not in path.parts:
                content = path.read_bytes()
                summed.update(f"\n{path.relative_to(ROOT).as_posix()} {len(content)}\n".encode())
                summed.update(content)
    return summed.hexdigest()[:32]


if __name__ == "__main__":
    with suppress(OSError):  # this user may not write to the environment
        prepare()
