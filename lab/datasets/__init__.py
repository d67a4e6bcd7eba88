"""Public sets of pictures with depth, read one pair at a time: ``open_set("nyu=/data/nyu")``."""

from lab.datasets.opening import SETS, open_set
from lab.datasets.pair import Frame, Pair, Part
from lab.datasets.splits import scene_of, split_by_scene

__all__ = ["SETS", "Frame", "Pair", "Part", "open_set", "scene_of", "split_by_scene"]
