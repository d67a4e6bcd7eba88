"""Contents in few bytes: what is packed comes out as it was."""

import gzip
import json
import struct

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays as any_array

from app.drawing.glb import STEP_M, Parts, Places, in_this_order, lines_glb, mesh_glb, textured_glb
from app.drawing.ordering import curve_order, lowest_first, reordered
from app.drawing.packing import GRID_BITS, pack, rounded
from tests.app.gltf import arrays as gltf_arrays
from tests.app.packed import unpacked

SPHERE = trimesh.creation.icosphere(subdivisions=3)
SPHERE_COLORS = np.random.default_rng(0).integers(0, 256, (len(SPHERE.vertices), 3), dtype=np.uint8)
KINDS = ["<f2", "<f4", "<u2", "<u4", "|u1", "|i1", "<i2", "<i4"]


def sphere_glb():
    return mesh_glb(np.asarray(SPHERE.vertices), np.asarray(SPHERE.faces), SPHERE_COLORS)


@settings(max_examples=60, deadline=None)
@given(st.data())
def test_any_array_comes_out_to_the_bit(data):
    kind, columns = data.draw(st.sampled_from(KINDS)), data.draw(st.integers(1, 4))
    array = data.draw(any_array(kind, (data.draw(st.integers(0, 20)), columns)))
    assert unpacked(pack(array)) == array.tobytes()


@pytest.mark.parametrize("array", [np.arange(7.0), np.zeros((2, 5), "<f4"), np.zeros((3, 2), ">f4")], ids=str)
def test_an_array_of_another_form_is_left_as_it_is(array):
    assert unpacked(pack(array)) == array.tobytes()


@settings(max_examples=60, deadline=None)
@given(any_array(np.uint8, st.tuples(st.integers(0, 40), st.just(3))))
def test_any_colours_come_out_to_the_bit(colors):
    assert unpacked(pack(colors)) == colors.tobytes()


@pytest.mark.parametrize("data", [b"", b"x", b"\xff\xd8 a picture", bytes(range(256))])
def test_a_file_comes_out_as_it_was(data):
    assert unpacked(pack(data)) == data


def indexed(triangles, vertices):
    """A glTF with these triangles in this order."""
    written = Parts.of(mesh_glb(np.eye(3), np.array([[0, 1, 2]]), np.zeros((3, 3), np.uint8)))
    kind = "<u2" if vertices < 65535 else "<u4"
    data = np.asarray(triangles, kind).tobytes()
    head = json.loads(json.dumps(written.head))
    row = written.primitive["indices"]
    head["accessors"][row] |= {"count": 3 * len(triangles), "componentType": 5123 if kind == "<u2" else 5125}
    head["bufferViews"][row]["byteLength"] = len(data)
    text = json.dumps(head).encode()
    text += b" " * (-len(text) % 4)
    body = written.body[: head["bufferViews"][row]["byteOffset"]] + data + bytes(-len(data) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(body), b"BIN\0") + body
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


@settings(max_examples=80, deadline=None)
@given(
    st.lists(
        st.tuples(*[st.integers(0, 65534)] * 3) | st.tuples(*[st.integers(0, 6)] * 3), min_size=1, max_size=20
    )
)
def test_any_triangles_in_any_order_come_out_to_the_bit(triangles):
    for vertices in (65534, 65536):
        glb = indexed(triangles, vertices)
        assert unpacked(pack(glb)) == glb


def test_the_triangles_of_a_walk_take_a_byte_each():
    glb = sphere_glb()
    parts = Parts.of(glb)
    alone = indexed(parts.array(parts.primitive["indices"]).reshape(-1, 3), 100)
    assert len(gzip.compress(pack(alone))) - len(gzip.compress(pack(indexed([[0, 1, 2]], 100)))) < len(
        SPHERE.faces
    )


def test_a_vertex_is_a_difference_to_the_mean_of_the_corners_below_it():
    """Worked out on paper: vertices 0 and 1 by the row before, 2 by 0 and 1, 3 by 1 and 2, 4 by 3 alone."""
    places_m = np.array([[0, 0, 0], [8, 0, 0], [4, 6, 2], [16, 9, 3], [18, 9, 2]]) * STEP_M
    corners = np.array([[0, 1, 2], [2, 1, 3], [4, 3, 5]])
    glb = in_this_order(
        Places(np.pad(places_m / STEP_M, ((0, 0), (0, 1))).round().astype("<u2"), [0.0] * 3, STEP_M),
        corners,
        np.zeros((5, 3), np.uint8),
    )
    packed = pack(glb)
    (length,) = struct.unpack_from("<I", packed)
    parts = json.loads(packed[4 : 4 + length])
    first = next(row for row, part in enumerate(parts) if part[0] == "vertices")
    assert parts[first] == ["vertices", 5, 3, 2, 8, 1]
    at = 4 + length + sum(count for _, count in parts[:first])
    planes = np.frombuffer(packed, np.uint8, 30, at).reshape(3, 2, 5)
    assert planes[:, 1].max() == 0
    differences = [[0, 8, 0, 10, 2], [0, 0, 6, 6, 0], [0, 0, 2, 2, -1]]
    assert planes[:, 0].tolist() == [[2 * d if d >= 0 else -2 * d - 1 for d in row] for row in differences]
    assert unpacked(packed) == glb


def test_numbers_that_are_multiples_are_packed_as_such():
    uv = np.random.default_rng(1).uniform(0, 1, (len(SPHERE.vertices), 2))
    places = np.asarray(SPHERE.vertices), np.asarray(SPHERE.faces), SPHERE_COLORS, uv, b"picture"
    sizes = {}
    for side_px, unit in ((100_000, 1), (640, 20)):
        glb = textured_glb(*places, side_px)
        packed = pack(glb)
        assert unpacked(packed) == glb
        assert b'["vertices",%d,2,2,4,%d]' % (len(uv), unit) in packed
        sizes[unit] = len(gzip.compress(packed))
    assert sizes[20] < sizes[1]


FILES = {
    "mesh": sphere_glb(),
    "textured": textured_glb(
        np.asarray(SPHERE.vertices),
        np.asarray(SPHERE.faces),
        SPHERE_COLORS,
        np.random.default_rng(1).uniform(0, 1, (len(SPHERE.vertices), 2)),
        b"\xff\xd8 a picture\xff\xd9",
        1280,
    ),
    "large": mesh_glb(400.0 * np.asarray(SPHERE.vertices), np.asarray(SPHERE.faces), SPHERE_COLORS),
    "backwards": indexed([[9, 4, 60000], [1, 1, 0], [65534, 65533, 2], [0, 3, 3]], 60000),
    "many": indexed([[70000, 4, 60000], [1 << 31, 1, 0], [(1 << 32) - 1, 65533, 2]], 70000),
    "lines": lines_glb(np.random.default_rng(0).uniform(-1, 1, (77, 2, 3)), (213, 40, 30)),
}


def test_a_gltf_of_another_program_comes_out_as_it_was():
    for scene in (SPHERE, trimesh.Scene([SPHERE, SPHERE.copy()])):
        glb = scene.export(file_type="glb")
        assert unpacked(pack(glb)) == glb


@pytest.mark.parametrize("vertices", [65534, 65535, 65536])
def test_indices_are_wide_enough(vertices):
    places = np.random.default_rng(0).uniform(0, 1, (vertices, 3))
    triangles = np.arange(vertices - vertices % 3).reshape(-1, 3)
    glb = mesh_glb(places, triangles, np.zeros((vertices, 3), np.uint8))
    found = gltf_arrays(glb)[1]["indices"]
    assert found.dtype == ("<u2" if vertices < 65535 else "<u4")
    assert len(np.unique(found)) == found.size
    assert found.max() < vertices


@pytest.mark.parametrize("name", FILES)
def test_a_gltf_comes_out_to_the_bit(name):
    assert unpacked(pack(FILES[name])) == FILES[name]


def test_a_surface_takes_far_less_than_its_deflated_bytes():
    grid = np.stack(np.meshgrid(np.arange(60), np.arange(60)), axis=-1).reshape(-1, 2)
    noise = np.random.default_rng(0).normal(0.0, 0.003, (3600, 3))
    vertices_m = np.column_stack([0.02 * grid, np.zeros(3600)]) + noise
    corner = (60 * np.arange(59)[:, None] + np.arange(59)).ravel()
    triangles = np.concatenate(
        [np.stack([corner, corner + 1, corner + 60], 1), np.stack([corner + 1, corner + 61, corner + 60], 1)]
    )
    shuffled = np.random.default_rng(1).permutation(3600)
    glb = mesh_glb(vertices_m[shuffled], np.argsort(shuffled)[triangles], np.full((3600, 3), 120, np.uint8))
    assert len(gzip.compress(pack(glb))) < 0.6 * len(gzip.compress(glb))


def test_points_on_the_grid_moved_by_at_most_half_a_step_and_take_half_the_bytes():
    points_m = np.random.default_rng(0).uniform(-5, 5, (2000, 3)).astype(np.float32)
    moved_m = rounded(points_m)
    assert np.abs(moved_m - points_m).max() <= 0.5 / 2**GRID_BITS + 1e-6
    assert unpacked(pack(moved_m)) == moved_m.tobytes()
    assert len(gzip.compress(pack(moved_m))) < 0.7 * len(gzip.compress(pack(points_m)))


def test_neighbours_along_the_curve_are_near():
    points = np.random.default_rng(0).uniform(0, 1, (4000, 3))
    order = curve_order(points)
    assert sorted(order) == list(range(4000))
    steps = np.linalg.norm(np.diff(points[order], axis=0), axis=1)
    assert np.median(steps) < 0.15 * np.median(np.linalg.norm(np.diff(points, axis=0), axis=1))
    assert len(curve_order(np.empty((0, 3)))) == 0
    assert list(curve_order(np.ones((3, 3)))) == [0, 1, 2]


def test_reordered_triangles_are_the_same_and_keep_their_orientation():
    order, triangles = reordered(np.asarray(SPHERE.vertices), np.asarray(SPHERE.faces))

    def turned(corners):
        return sorted(min(one[turn:] + one[:turn] for turn in range(3)) for one in corners.tolist())

    assert turned(order[triangles]) == turned(np.asarray(SPHERE.faces))
    assert np.all(np.diff(triangles[:, 0]) >= 0)
    assert np.array_equal(lowest_first(np.array([[2, 0, 1], [5, 4, 3]])), [[0, 1, 2], [3, 5, 4]])
