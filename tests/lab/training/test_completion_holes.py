import numpy as np
import pytest

from lab.training.completion.holes import (
    around_edges,
    displaced_edges,
    ellipse,
    hidden,
    lesson,
    misregistered,
    smooth_piece,
)
from lab.training.furniture import Catalogue, Entry
from lab.worlds.pieces.stock import VARIANTS, from_stock
from packetmesh.errors import InputError


@pytest.fixture(scope="module")
def room():
    """A box of 0.4 m edge before a slanted wall: colours, and depth in metres."""
    y, x = np.indices((240, 320))
    depth_m = (2.0 + 0.004 * x).astype(np.float32)
    depth_m[100:160, 120:180] = 1.5
    depth_m[:3] = np.nan
    rgb = np.dstack([x % 256, y, np.where(depth_m < 1.6, 200, 60)]).astype(np.uint8)
    return rgb, depth_m


def test_every_lesson_can_be_learned_from(room):
    shares = []
    for seed in range(60):
        seen = lesson(*room, np.random.default_rng(seed))
        known, learned = seen.grid.known, seen.log_z
        assert seen.grid.rgb.shape == (120, 160, 3)
        assert learned.shape == known.shape == (120, 160)
        assert known.sum() >= 50
        assert np.isfinite(seen.grid.log_z).all()
        assert not seen.grid.log_z[~known].any()  # nothing of a hidden pixel is left
        np.testing.assert_array_equal(learned[known], seen.grid.log_z[known])
        there = np.isfinite(learned)
        assert there.mean() > 0.9
        shares.append(1.0 - known[there].mean())
    assert min(shares) < 0.1
    assert max(shares) > 0.4


def test_the_same_draws_give_the_same_lesson(room):
    a, b = (lesson(*room, np.random.default_rng(7)) for _ in range(2))
    np.testing.assert_array_equal(a.log_z, b.log_z)
    np.testing.assert_array_equal(a.grid.rgb, b.grid.rgb)


def test_what_is_hidden_is_true_depth_without_the_sensors_noise(room):
    rgb, depth_m = room
    flat = np.full_like(depth_m, 2.0)
    rough = []
    for seed in range(20):
        seen = lesson(rgb, flat, np.random.default_rng(seed))
        unknown = ~seen.grid.known & np.isfinite(seen.log_z)
        if unknown.any() and seen.grid.known.any():
            steps = np.abs(np.diff(seen.log_z, axis=1))
            inside = unknown[:, 1:] & unknown[:, :-1]
            rough.append(steps[inside].max() if inside.any() else 0.0)
    assert max(rough) < 0.005  # a bias goes on smoothly, noise does not


def test_edges_are_lost_around_steps_and_whole_objects_go():
    log_z = np.zeros((120, 160), np.float32)
    log_z[40:80, 60:100] = -0.4
    near_edge = np.zeros(log_z.shape, bool)
    near_edge[34:86, 54:106] = True
    near_edge[46:74, 66:94] = False
    for seed in range(10):
        assert not (around_edges(log_z, 3, np.random.default_rng(seed)) & ~near_edge).any()
    there = np.ones(log_z.shape, bool)
    pieces = [smooth_piece(log_z, there, np.random.default_rng(seed)) for seed in range(60)]
    boxes = [piece for piece in pieces if piece.any()]
    assert boxes  # the background is too large to be lost as an object
    for piece in boxes:
        assert piece[40:80, 60:100].all()
        assert piece.mean() < 0.15


def test_ellipses_come_in_every_size_and_never_hide_all():
    there = np.ones((120, 160), bool)
    sizes = [np.sqrt(ellipse((120, 160), np.random.default_rng(seed)).sum() / np.pi) for seed in range(300)]
    assert np.quantile([size for size in sizes if size], 0.2) < 5.0
    assert max(sizes) > 25.0
    rgb, log_z = np.zeros((120, 160, 3), np.uint8), np.zeros((120, 160), np.float32)
    for seed in range(30):
        assert hidden(log_z, there, rgb, np.random.default_rng(seed)).mean() < 0.9


def test_ragged_edges_stay_between_front_and_back():
    log_z = np.zeros((120, 160), np.float32)
    log_z[:, 80:] = 0.5
    there = np.ones(log_z.shape, bool)
    changed = displaced_edges(log_z, there, np.random.default_rng(0))
    assert ((changed >= 0.0) & (changed <= 0.5)).all()
    moved = changed != log_z
    assert moved.any()
    assert not moved[:, :78].any()
    assert not moved[:, 82:].any()


def test_some_lessons_have_no_picture():
    rgb = np.zeros((120, 160, 3), np.uint8)
    rgb[:, 80:] = 255
    steps = []
    for seed in range(100):
        seen = misregistered(rgb, np.random.default_rng(seed)).astype(float)
        steps.append(abs(seen[:, 100:].mean() - seen[:, :60].mean()))
    blind = np.mean(np.array(steps) < 10.0)
    assert 0.04 < blind < 0.25


def test_no_piece_and_no_authors_models_are_in_two_splits(tmp_path):
    drawn = [
        {from_stock(lambda rng: float(rng.random()), first + k, np.random.default_rng(k)) for k in range(500)}
        for first in (0, 1_000_000, 2_000_000)
    ]
    assert all(len(stock) > VARIANTS // 4 for stock in drawn)
    assert not drawn[0] & drawn[1]
    assert not drawn[0] & drawn[2]
    assert not drawn[1] & drawn[2]
    authors = ("scopia", "katorlegaz", "blendswap-cc-by", "blendswap-cc-0")
    entries = tuple(_entry(tmp_path, f"{author}/chair/chair.obj") for author in authors)
    catalogue = Catalogue(entries, (), tmp_path)
    splits = [
        {entry.author for entry in catalogue.of_split(split).entries}
        for split in ("train", "validation", "test")
    ]
    assert splits == [{"scopia", "blendswap-cc-0"}, {"katorlegaz"}, {"blendswap-cc-by"}]
    with pytest.raises(InputError, match="test rooms are furnished from"):
        Catalogue(entries[:1], (), tmp_path).of_split("test")


def _entry(folder, model):
    return Entry("Chair", "Office", np.ones(3), 0.0, np.eye(3), None, folder / "a.zip", model, "chair")
