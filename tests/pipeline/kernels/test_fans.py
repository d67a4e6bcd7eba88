"""Walks over meshes."""

import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st

from pipeline.kernels.fans import walked

GRID = np.arange(64).reshape(8, 8)
GRID = np.concatenate(
    [
        np.stack([GRID[:-1, :-1], GRID[:-1, 1:], GRID[1:, :-1]], axis=-1).reshape(-1, 3),
        np.stack([GRID[:-1, 1:], GRID[1:, 1:], GRID[1:, :-1]], axis=-1).reshape(-1, 3),
    ]
)


def turned(triangles):
    return sorted(min(row[turn:] + row[:turn] for turn in range(3)) for row in np.asarray(triangles).tolist())


@given(
    st.integers(1, 12).flatmap(
        lambda count: st.tuples(
            st.just(count), st.lists(st.tuples(*[st.integers(0, count - 1)] * 3), max_size=30)
        )
    )
)
def test_any_triangles_are_kept_with_their_orientation(drawn):
    count, triangles = drawn
    order, faces = walked(np.array(triangles, np.int64).reshape(-1, 3), count)
    assert sorted(order) == list(range(count))
    assert turned(order[faces]) == turned(triangles)


@pytest.mark.parametrize(
    "mesh", [GRID, np.asarray(trimesh.creation.icosphere(subdivisions=3).faces)], ids=len
)
def test_a_vertex_is_numbered_when_it_is_met_and_a_fan_goes_round(mesh):
    shuffled = np.random.default_rng(0).permutation(len(mesh))
    order, faces = walked(mesh[shuffled], mesh.max() + 1)
    assert order[0] == 0
    greatest, fans = 0, 0
    for row, (a, b, c) in enumerate(faces):
        for one in (b, c):
            assert one <= greatest + 1
            greatest = max(greatest, one)
        assert a >= faces[row - 1, 0] or row == 0
        fans += row > 0 and a == faces[row - 1, 0] and b == faces[row - 1, 2]
    follow = np.count_nonzero(np.diff(faces[:, 0]) == 0)
    assert fans > 0.9 * follow


def test_vertices_without_triangles_and_pieces_come_in_their_order():
    order, faces = walked(np.array([[4, 5, 6], [1, 2, 3]]), 8)
    assert order.tolist() == [0, 1, 2, 3, 4, 5, 6, 7]
    assert faces.tolist() == [[1, 2, 3], [4, 5, 6]]
    assert len(walked(np.empty((0, 3), np.int64), 0)[0]) == 0
