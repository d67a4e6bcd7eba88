"""Public sets of pictures with depth, read one pair at a time: ``open_set("nyu=/data/nyu")``."""

from pipeline.depth.sets.opening import SETS, open_set
from pipeline.depth.sets.pair import Frame, Pair, Part
from pipeline.depth.sets.splits import scene_of, split_by_scene

__all__ = ["SETS", "Frame", "Pair", "Part", "open_set", "scene_of", "split_by_scene"]
