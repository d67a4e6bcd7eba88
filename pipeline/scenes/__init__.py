"""Places with ground truth: demo scenes, random rooms, the renderer and the model of the depth sensor."""

from pipeline.scenes.boxes import box_room
from pipeline.scenes.demos import DEMO_SCENES, build_demo, load_demo
from pipeline.scenes.render import View, render
from pipeline.scenes.rooms import random_room
from pipeline.scenes.scene import Scene
from pipeline.scenes.sensor import sense_depth

__all__ = [
    "DEMO_SCENES",
    "Scene",
    "View",
    "box_room",
    "build_demo",
    "load_demo",
    "random_room",
    "render",
    "sense_depth",
]
