"""The slider of averaged frames on the Surface screen: only for recordings whose camera stands."""

import numpy as np
import pytest

from app.compute.records import AveragedView
from app.compute.state import Spec
from app.screens.scene.job import averaged_view
from app.screens.surface.frames import frames_html
from app.screens.surface.panel import SurfacePanel
from packetmesh.progress import drain
from pipeline.recording.opening import iterate_still
from pipeline.sources import Demo, Recorded
from pipeline.types import Rig
from tests.app.fakes import Bench, Impatient, ui_of
from tests.pipeline.recording.standing import Frames, pictures, wall, write_tum


def flickering(frames):
    """A wall of which every frame lacks another quarter."""
    depths_m = wall(frames)
    for k, depth_m in enumerate(depths_m):
        depth_m[:, k % 4 :: 4] = np.nan
    return depths_m


@pytest.fixture
def bench(tmp_path, store, server):
    """The Surface screen of a recording of eight frames, with the Scene step computed."""
    spec = Spec(Recorded(str(write_tum(tmp_path / "still", flickering(8)))))
    bench = Bench(SurfacePanel, ui_of(server.scene, kind=Impatient), store, steps=("scene",), spec=spec)
    bench.advance()
    return bench


def test_the_slider_goes_to_the_frames_there_are(bench):
    slider = bench.gui.find("Frames")
    assert slider.visible
    assert (slider.min, slider.max, slider.value) == (1, 8, 8)
    assert bench.spec.config.recording.frames == 64


def test_holes_close_with_more_frames_and_all_numbers_stay(bench):
    bench.gui.set("Frames", 1)
    assert bench.spec.config.recording.frames == 1
    assert bench.gui.find("Frames").value == 1
    alone = bench.results.view("scene").averaged
    assert alone.frames == 1
    assert alone.unmeasured_share > 0.25
    bench.gui.set("Frames", 2)
    both = bench.results.view("scene").averaged
    assert both.unmeasured_share < 0.1
    text = bench.gui.text()
    assert f"{100 * both.unmeasured_share:.1f} %</b> of the pixels have no depth with 2 frames" in text
    assert (
        f"Tried: {100 * alone.unmeasured_share:.1f} % with 1, {100 * both.unmeasured_share:.1f} % with 2, "
        in text
    )


def test_other_sources_have_no_slider(bench):
    bench.want(Spec(Demo("box-on-table")))
    assert not bench.gui.find("Frames").visible
    assert "have no depth" not in bench.gui.text()


def test_another_recording_begins_anew(bench, tmp_path):
    other = write_tum(tmp_path / "other", wall(5))
    bench.want(Spec(Recorded(str(other))))
    assert bench.gui.find("Frames").max == 5
    assert "Tried" not in bench.gui.text()


def test_several_cameras_are_averaged():
    def frame(depths_m, frames):
        recording = Frames(depths_m, pictures(*[100] * len(depths_m)))
        return drain(iterate_still(recording, frames))

    full, half = wall(4), flickering(4)
    rig = Rig("rig", (frame(full, 4), frame(half, 1)))
    view = averaged_view(rig)
    assert (view.frames, view.available) == (4, 4)
    expected = 1.0 - np.mean([one.depth.coverage for one in rig.frames])
    assert view.unmeasured_share == pytest.approx(expected)
    assert averaged_view(Rig("none", ())) is None


def test_the_numbers_have_their_units():
    view = AveragedView(1, 30, 0.25, 0.01, 0.02, 0.0034)
    text = frames_html(view, {1: view})
    assert "<b>25.0 %</b> of the pixels have no depth with 1 frame; noise 3.4 mm" in text
    assert "1.0 % moved, 2.0 % flicker" in text
