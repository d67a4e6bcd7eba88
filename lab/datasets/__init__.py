"""Public data sets of images with depth, read one pair after the other: ``open_set("nyu=/data/nyu")``."""

from lab.datasets.opening import SETS, open_set
from lab.datasets.pair import Pair

__all__ = ["SETS", "Pair", "open_set"]
