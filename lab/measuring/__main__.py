"""Print the basis of a constant of measuring: ``python -m lab.measuring guesses|misfit|poses [ROOMS]``."""

from __future__ import annotations

import argparse

from lab.measuring.constants import guesses, misfit, poses

COMMANDS = {"guesses": guesses, "misfit": misfit, "poses": poses}
ROOMS = 40


def main() -> None:
    """Print the numbers from the tuning rooms, which are not used for judging."""
    parser = argparse.ArgumentParser(prog="python -m lab.measuring", description=__doc__)
    parser.add_argument("constant", choices=COMMANDS)
    parser.add_argument("rooms", nargs="?", type=int, default=ROOMS)
    options = parser.parse_args()
    COMMANDS[options.constant](options.rooms)


if __name__ == "__main__":
    main()
