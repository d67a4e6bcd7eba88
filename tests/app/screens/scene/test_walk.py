"""A recording on the Scene screen: a few keyframes, and what became of its frames."""

from app.compute.state import Spec
from app.screens.scene.job import scene_job
from lab.walks.walk import kinect, render_walk
from lab.worlds.rooms import random_room
from packetmesh.progress import drain
from pipeline.sources import Recorded


def test_the_scene_screen_shows_keyframes_and_says_what_became_of_the_frames(store, tmp_path):
    render_walk(random_room(5_000_001), 8, kinect(160), tmp_path / "walk")
    view = drain(scene_job(store, Spec(Recorded(str(tmp_path / "walk")))))
    assert view.notes[0].startswith("A recording of 8 frames over 0.")
    assert f"; its nodes are {len(view.nodes)} of its " in view.notes[0]
    assert all(node.name.startswith("frame_0000") for node in view.nodes)
