"""``python -m lab.claims.registration tune``: choose the parameters anew, on rooms of their own."""

from __future__ import annotations

import argparse
import logging
import tempfile
from pathlib import Path

from lab.claims.registration import tuned
from lab.claims.registration.tuning import tune, write_tuned

logger = logging.getLogger(__name__)


def main() -> None:
    """Tune and write the module ``tuned``."""
    logging.basicConfig(level=logging.INFO, format="%(message)s")
    parser = argparse.ArgumentParser(prog="python -m lab.claims.registration")
    parser.add_argument("command", choices=["tune"])
    parser.add_argument("--folder", type=Path, help="keeps the results, so that a stopped run can go on")
    parser.add_argument("--workers", type=int, default=2)
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as temporary:
        running = tune(arguments.folder or Path(temporary), workers=arguments.workers)
        while True:
            try:
                progress = next(running)
            except StopIteration as end:
                write_tuned(end.value, Path(tuned.__file__))
                return
            logger.info("%4.0f%%  %s", 100.0 * progress.fraction, progress.stage)


if __name__ == "__main__":
    main()
