"""Places with ground truth: demo scenes, random rooms, the renderer and the model of the depth sensor."""

from lab.worlds.boxes import box_room
from lab.worlds.render import View, render
from lab.worlds.rooms import random_room
from lab.worlds.scene import Scene
from lab.worlds.sensor import sense_depth

__all__ = ["Scene", "View", "box_room", "random_room", "render", "sense_depth"]
