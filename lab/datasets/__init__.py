"""Public sets of pictures with depth, read one pair at a time: ``open_set("nyu=/data/nyu")``."""

from lab.datasets.opening import SETS, open_set
from lab.datasets.pair import Pair

__all__ = ["SETS", "Pair", "open_set"]
