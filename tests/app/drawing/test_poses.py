"""Poses as viser takes them."""

import numpy as np

from app.drawing.poses import place, wxyz_of
from pipeline.kernels.geometry import rigid, rotation_exp


class Recorder:
    """A scene node that remembers every pose it was given."""

    def __init__(self):
        object.__setattr__(self, "given", {"wxyz": [], "position": []})

    def __setattr__(self, name, value):
        self.given[name].append(np.array(value))


def test_a_node_at_the_origin_is_still_told_its_pose():
    node = Recorder()
    place(node, np.eye(4))
    for name, fresh in (("wxyz", (1.0, 0, 0, 0)), ("position", (0.0, 0, 0))):
        assert not np.allclose(node.given[name][0], fresh)
        np.testing.assert_allclose(node.given[name][-1], fresh, atol=1e-12)


def test_quaternions_put_w_first():
    quarter_turn_about_z = rigid(rotation_exp([0.0, 0.0, np.pi / 2]), [1.0, 2.0, 3.0])
    np.testing.assert_allclose(wxyz_of(quarter_turn_about_z), (np.sqrt(0.5), 0, 0, np.sqrt(0.5)), atol=1e-12)
