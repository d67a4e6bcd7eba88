"""Registration of images of which few tiles have arrived: the base layer takes part."""

import numpy as np

from packetmesh.progress import drain
from pipeline.config import AcquisitionConfig
from pipeline.delivery.left_out import grid_of, without_tiles
from pipeline.delivery.sink import frame_at_sink, images_of
from pipeline.delivery.tiled import AVIF, TILE, own_order
from pipeline.io.demos import load_demo
from pipeline.kernels.geometry import inverse
from pipeline.nodes import with_coarse_depth
from pipeline.sources import LoadedRig
from pipeline.spec import Spec
from pipeline.stages import RunCache, compute
from pipeline.types import Rig


def few_tiles(frame, share):
    """The frame at the sink if a share of its depth tiles has arrived, in the coding's order."""
    images = images_of(frame)
    rows, columns = grid_of(images.depth.shape, TILE)
    left_out = np.ones(rows * columns, np.bool_)
    left_out[own_order(left_out.size)[: round(share * left_out.size)]] = False
    return frame_at_sink(frame, without_tiles(images, left_out.reshape(rows, columns), AVIF.side_px))


def test_three_per_cent_of_the_tiles_and_the_base_layers_place_the_cameras():
    rig = load_demo("living-room")
    few = Rig(rig.name, tuple(few_tiles(frame, 0.03) for frame in rig.frames))
    placement = drain(compute(Spec(LoadedRig(few)), "placement", RunCache())).value
    true, found = rig.truth.T_world_camera, placement.T_world_camera
    for index in (1, 2):
        there, here = inverse(true[0]) @ true[index], inverse(found[0]) @ found[index]
        assert np.linalg.norm((there - here)[:3, 3]) < 0.02


def test_the_base_layer_is_no_measurement_after_the_registration():
    rig = load_demo("living-room")
    few = Rig(rig.name, tuple(few_tiles(frame, 0.03) for frame in rig.frames))
    nodes = drain(compute(Spec(LoadedRig(few)), "nodes", RunCache())).value
    for frame, node in zip(few.frames, nodes, strict=True):
        assert len(node.sensor) <= frame.depth.valid.sum()


def test_a_frame_without_coarse_depth_is_registered_as_it_is():
    frame = load_demo("office").frames[0]
    assert with_coarse_depth(frame, None, AcquisitionConfig()) == (frame, None)
