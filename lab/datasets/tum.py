"""TUM RGB-D sequences: images and depth with separate time stamps.

Sturm et al., "A Benchmark for the Evaluation of RGB-D SLAM Systems", IROS 2012.
"""

from __future__ import annotations

from functools import partial
from pathlib import Path

from lab.datasets.pair import Load, load_pair
from pipeline.importing.tum import UNITS_PER_METRE, associate, listed


def find(root: Path) -> list[Load]:
    """Return the frames of the sequence ``root``, or of all sequences below it.

    Raises:
        InputError: a line of a list is not a time and a file.
    """
    pairs: list[Load] = []
    for listing in sorted(root.rglob("rgb.txt")):
        folder = listing.parent
        if (folder / "depth.txt").is_file():
            (rgb_s, pictures), (depth_s, depths) = listed(listing), listed(folder / "depth.txt")
            for i, j in associate(rgb_s, depth_s):
                files = folder / pictures[i], folder / depths[j]
                pairs.append(partial(load_pair, *files, UNITS_PER_METRE))
    return pairs
