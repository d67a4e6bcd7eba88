"""The hand-out: small, closed in itself, and true to the meshes and frames that it was given."""

from __future__ import annotations

import base64
import io
import json
import re
import zlib
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image
from scipy.spatial import cKDTree

from app.drawing.colors import BACKGROUND
from app.reports import delivery
from app.reports.delivery import FramesOnAir, delivery_animation, delivery_page, thumbnail
from app.reports.hand_out import ASPECT, FIELD_RAD, viewpoint
from packetmesh.errors import InputError
from tests.app.hand_outs import CAUSES, END_S, RED, hand_out, wall

BLOCK = re.compile(r'<script type="text/plain" id="([^"]+)">([^<]*)</script>')


def blocks(page: str) -> dict[str, bytes]:
    return {name: base64.b64decode(text, validate=True) for name, text in BLOCK.findall(page)}


def record(page: str) -> dict:
    return json.loads(re.search(r'<script type="application/json" id="record">(.*?)</script>', page)[1])


def numbers(data: bytes, offset: int, count: int, planes: int) -> tuple[np.ndarray, int]:
    """A column that lies byte plane by byte plane, and where the next one begins."""
    bytes_ = np.frombuffer(data, np.uint8, count * planes, offset).reshape(planes, count).astype(np.int64)
    return sum(plane << (8 * row) for row, plane in enumerate(bytes_)), offset + count * planes


def unpacked(block: bytes, box: dict) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Vertices in metres, triangles and colours, read as the format says."""
    data = zlib.decompress(block)
    vertices, faces = np.frombuffer(data, "<u4", 2)
    offset, axes, channels, corners = 8, [], [], []
    for _ in range(3):
        zigzag, offset = numbers(data, offset, vertices, 2)
        axes.append(np.cumsum((zigzag >> 1) ^ -(zigzag & 1)) % 65_536)
    for _ in range(3):
        delta, offset = numbers(data, offset, vertices, 1)
        channels.append(np.cumsum(delta))
    for _ in range(3):
        column, offset = numbers(data, offset, faces, 4)
        corners.append(column)
    assert offset == len(data)
    low = np.cumsum(corners[0])
    green = channels[0]
    return (
        np.array(box["low_m"]) + box["step_m"] * np.column_stack(axes),
        np.column_stack([low, low + corners[1], low + corners[2]]),
        np.column_stack([green + channels[1], green, green + channels[2]]) % 256,
    )


def turned(triangles: np.ndarray) -> set[tuple[int, ...]]:
    """Triangles, each from its lowest corner on, so that mirrored ones differ."""
    return {tuple(np.roll(triangle, -int(np.argmin(triangle))).tolist()) for triangle in triangles}


def test_every_moments_mesh_survives_to_within_its_steps():
    given = hand_out()
    page = delivery_page(given)
    kept, box = blocks(page), record(page)["box"]
    for row, moment in enumerate(given.moments):
        vertices_m, triangles, colors = unpacked(kept[f"mesh-{row}"], box)
        if moment.surface is None:
            assert len(vertices_m) == len(triangles) == 0
            continue
        _, at = cKDTree(moment.surface.vertices_m).query(vertices_m)
        assert len(set(at.tolist())) == len(vertices_m) == len(moment.surface.vertices_m)
        assert np.abs(vertices_m - moment.surface.vertices_m[at]).max() <= 0.501 * box["step_m"]
        np.testing.assert_array_equal(colors, moment.surface.colors[at])
        assert turned(at[triangles]) == turned(moment.surface.triangles)
    assert box["step_m"] < 1e-3


def test_vertices_without_a_triangle_do_not_travel():
    given = hand_out((4,))
    surface = given.moments[0].surface
    some = replace(surface, triangles=surface.triangles[:5])
    given = replace(given, moments=(replace(given.moments[0], surface=some),))
    page = delivery_page(given)
    vertices_m, triangles, _ = unpacked(blocks(page)["mesh-0"], record(page)["box"])
    assert len(triangles) == 5
    assert len(vertices_m) == len(np.unique(some.triangles))


def test_meshes_are_thinned_until_the_page_is_small_enough_the_last_one_least(monkeypatch):
    given = hand_out()
    large = tuple(replace(moment, surface=wall(90, 90, seed=row)) for row, moment in enumerate(given.moments))
    given = replace(given, moments=large)
    most_bytes = 250_000
    assert len(delivery_page(given).encode()) > most_bytes
    monkeypatch.setattr(delivery, "MOST_BYTES", most_bytes)
    page = delivery_page(given)
    assert 0.7 * most_bytes < len(page.encode()) <= most_bytes
    box = record(page)["box"]
    counts = [len(unpacked(blocks(page)[f"mesh-{row}"], box)[1]) for row in range(len(large))]
    assert min(counts) >= 500
    assert counts[-1] > 2 * max(counts[:-1])
    vertices_m = unpacked(blocks(page)["mesh-0"], box)[0]
    assert np.abs(vertices_m[:, 2] - 2.0).max() < 0.03  # still the wall
    assert [moment["triangles"] for moment in record(page)["moments"]] == [16_200] * len(large)


def test_frames_arrive_with_their_times_and_causes():
    given = hand_out()
    page = delivery_page(given)
    data, tick_s = zlib.decompress(blocks(page)["frames"]), record(page)["tick_s"]
    counts = np.frombuffer(data, "<u4", 2)
    total = int(counts.sum())
    since, offset = numbers(data, 8, total, 4)
    duration, offset = numbers(data, offset, total, 4)
    cause, offset = numbers(data, offset, total, 1)
    assert offset == len(data)
    first = 0
    for node, count in enumerate(counts.tolist()):
        mine = np.flatnonzero(given.frames.node == node)
        mine = mine[np.argsort(given.frames.start_s[mine])]
        rows = slice(first, first + count)
        start_s = tick_s * np.cumsum(since[rows])
        np.testing.assert_allclose(start_s, given.frames.start_s[mine], atol=tick_s)
        np.testing.assert_allclose(start_s + tick_s * duration[rows], given.frames.end_s[mine], atol=tick_s)
        np.testing.assert_array_equal(cause[rows], given.frames.cause[mine])
        first += count
    assert tick_s <= 1e-5
    assert record(page)["causes"] == list(CAUSES)


def test_too_many_frames_end_earlier_and_the_page_knows_when(monkeypatch):
    monkeypatch.setattr(delivery, "MOST_FRAMES", 50)
    given = hand_out()
    page = delivery_page(given)
    counts = np.frombuffer(zlib.decompress(blocks(page)["frames"]), "<u4", 2)
    assert counts.sum() == 50
    assert record(page)["frames_until_s"] == np.sort(given.frames.start_s)[50]


def test_a_delivery_of_which_nothing_arrived_has_a_page_all_the_same():
    none = np.zeros(0)
    silent = FramesOnAir(none.astype(int), none, none, none.astype(int), ("",))
    given = hand_out((0, 0), on_air=silent)
    bare = tuple(replace(moment, thumbnails=(b"", b""), f_score=None) for moment in given.moments)
    page = delivery_page(replace(given, moments=bare))
    assert not [name for name in blocks(page) if name.startswith("picture")]
    assert record(page)["moments"][1]["f_score"] is None
    assert len(Image.open(io.BytesIO(delivery_animation(replace(given, moments=bare)))).getcolors(256)) > 1


def test_text_from_outside_stays_text():
    evil = '</script><script>alert("1")</script>$sentence'
    page = delivery_page(hand_out(title=evil, names=(evil, "b")))
    assert "<script>alert" not in page
    assert record(page)["nodes"][0]["name"] == evil
    assert "A wall grows.</p>" in page


def test_the_page_names_no_other_place():
    page = BLOCK.sub("", delivery_page(hand_out()))
    for word in ("http:", "https:", " src=", "href=", "url(", "@import", "fetch(", "import("):
        assert word not in page, word
    assert "default-src 'none'" in page


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda given: {"moments": ()}, "no moment"),
        (lambda given: {"nodes": ()}, "no node"),
        (lambda given: {"nodes": given.nodes[:1]}, "2 pictures"),
    ],
)
def test_what_cannot_be_shown_is_refused_in_words(change, words):
    given = hand_out()
    with pytest.raises(InputError, match=words):
        replace(given, **change(given))


@pytest.mark.parametrize("up", [(0.0, -1.0, 0.0), (0.0, 0.0, 1.0)])
def test_the_first_view_is_behind_the_first_camera_and_holds_everything(up):
    given = hand_out()
    # The same scene in a world whose third axis points up.
    turn = np.eye(3) if up[1] else np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])
    T = np.eye(4)
    T[:3, :3] = turn
    moved = tuple(replace(node, T_world_camera=T @ node.T_world_camera) for node in given.nodes)
    surface = given.moments[-1].surface
    points_m = surface.vertices_m @ turn.T
    last = replace(given.moments[-1], surface=replace(surface, vertices_m=points_m))
    view = viewpoint(replace(given, nodes=moved, moments=(last,)))
    np.testing.assert_allclose(view.up, up)
    ahead = view.middle_m - view.eye_m
    ahead /= np.linalg.norm(ahead)
    right = np.cross(ahead, up) / np.linalg.norm(np.cross(ahead, up))
    seen_m = np.vstack([points_m, [node.T_world_camera[:3, 3] for node in moved]]) - view.eye_m
    depth_m = seen_m @ ahead
    assert depth_m.min() > 0.0
    reach = depth_m * np.tan(0.5 * FIELD_RAD)
    assert (np.abs(seen_m @ np.cross(right, ahead)) < reach).all()
    assert (np.abs(seen_m @ right) < ASPECT * reach).all()
    forward = moved[0].T_world_camera[:3, 2]
    assert (view.eye_m - moved[0].T_world_camera[:3, 3]) @ forward < 0.0  # behind
    assert ahead @ up < 0.0  # from above


def test_a_thumbnail_shows_what_arrived_and_a_grey_pattern_elsewhere():
    rgb = np.full((240, 320, 3), RED, np.uint8)
    known = np.broadcast_to(np.arange(320) < 160, (240, 320))
    picture = np.asarray(Image.open(io.BytesIO(thumbnail(rgb, known)))).astype(int)
    width = picture.shape[1]
    assert np.abs(picture[:, : width // 2 - 8] - RED).mean() < 6
    right = picture[:, width // 2 + 8 :]
    assert np.ptp(right, axis=2).max() < 12  # grey
    assert np.ptp(right) > 30  # of more than one kind
    assert thumbnail(rgb, np.zeros((240, 320), bool)) == b""


def test_the_moving_picture_shows_every_moment_and_rests_on_the_last():
    given = hand_out()
    movie = Image.open(io.BytesIO(delivery_animation(given)))
    assert movie.n_frames == len(given.moments)
    reds, stays_ms = [], []
    for index in range(movie.n_frames):
        movie.seek(index)
        room = np.asarray(movie.convert("RGB"))[50:520, :630].astype(int)
        reds.append(int((room[..., 0] - room[..., 1:].max(axis=2) > 60).sum()))
        stays_ms.append(movie.info["duration"])
    assert reds[0] == 0
    assert np.all(np.diff(reds) > 1000)
    assert stays_ms[-1] == 3000
    assert sum(stays_ms[:-1]) == pytest.approx(1000 * 10.0 * (END_S - given.moments[0].t_s) / END_S, rel=0.02)
    assert movie.info["loop"] == 0
    corner = np.asarray(movie.convert("RGB"))[60, 5]
    assert np.abs(corner.astype(int) - BACKGROUND).max() < 8
