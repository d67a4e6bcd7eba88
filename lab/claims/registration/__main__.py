"""``python -m lab.claims.registration FOLDER``: tune the methods' parameters again, in separate rooms."""

from __future__ import annotations

import argparse
import logging
from pathlib import Path

from lab.claims.registration import tuned
from lab.claims.registration.tuning import tune, write_tuned
from packetmesh.progress import Progress, drain

logger = logging.getLogger(__name__)


def main() -> None:
    """Tune the methods' parameters and write the module ``tuned``."""
    logging.basicConfig(level=logging.INFO, format="%(message)s")
    parser = argparse.ArgumentParser(prog="python -m lab.claims.registration")
    parser.add_argument("folder", type=Path, help="keeps the trials, so that an interrupted run resumes")
    parser.add_argument("--scheduler", help="address of a Dask scheduler; without it, this machine's cores")
    arguments = parser.parse_args()
    chosen = drain(tune(arguments.folder, arguments.scheduler), _log)
    write_tuned(chosen, Path(tuned.__file__))


def _log(progress: Progress) -> None:
    logger.info("%4.0f%%  %s", 100.0 * progress.fraction, progress.stage)


if __name__ == "__main__":
    main()
