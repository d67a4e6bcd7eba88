"""``python -m lab.results record NAME...`` measures; ``python -m lab.results write`` writes the pages."""

from __future__ import annotations

import argparse
import sys

from lab.results.measure import RECORDS, measure
from lab.results.pages import write_pages
from lab.results.record import write_record
from packetmesh.errors import PacketMeshError


def main() -> None:
    """Record results, or write the pages that show them."""
    parser = argparse.ArgumentParser(prog="python -m lab.results", description=__doc__)
    commands = parser.add_subparsers(dest="command", required=True)
    record = commands.add_parser("record", help="run commands and write docs/results/NAME.json")
    record.add_argument("names", nargs="+", metavar="NAME", help=", ".join(RECORDS))
    commands.add_parser("write", help="write docs/results.md and the results in README.md from the records")
    options = parser.parse_args()
    try:
        for name in getattr(options, "names", ()):
            write_record(measure(name))
        write_pages()
    except PacketMeshError as error:
        sys.exit(f"results: {error}")


if __name__ == "__main__":
    main()
