"""``python -m lab.places``: render pairs into the cache, about two seconds each."""

from __future__ import annotations

import argparse
from pathlib import Path

from lab.places.pairs import CACHE, HELD_OUT, VALIDATION, Split, bench_pairs, mixed_pairs, pair


def main() -> None:
    """Render the pairs that the cache lacks."""
    parser = argparse.ArgumentParser(prog="python -m lab.places", description=__doc__)
    parser.add_argument("--folder", type=Path, default=CACHE, help="folder of the cache")
    parser.add_argument("--split", choices=(VALIDATION, HELD_OUT), required=True)
    parser.add_argument("--per-class", type=int, default=0, help="pairs of each of the benchmark's overlaps")
    parser.add_argument("--mixed", type=int, default=0, help="pairs of any overlap")
    options = parser.parse_args()
    split: Split = options.split
    for index, overlap in (*bench_pairs(options.per_class), *mixed_pairs(split, options.mixed)):
        pair(split, index, overlap, options.folder)


if __name__ == "__main__":
    main()
