import numpy as np
import pytest

from lab.training.dataset import FIRST_SEED, Shards, augment, render_shards, zoom


@pytest.fixture
def two_rooms_a_shard(monkeypatch):
    monkeypatch.setattr("lab.training.dataset.ROOMS_PER_SHARD", 1)
    monkeypatch.setattr("lab.training.dataset.VIEWS_PER_ROOM", 2)


@pytest.mark.usefixtures("two_rooms_a_shard")
def test_shards_are_reproducible_found_again_and_not_rendered_twice(tmp_path):
    first, second = (list(render_shards(tmp_path / name, "train", 0, 1)) for name in "ab")
    assert [file.read_bytes() for file in first] == [file.read_bytes() for file in second]
    written = first[0].stat().st_mtime_ns
    list(render_shards(tmp_path / "a", "train", 0, 2))
    assert first[0].stat().st_mtime_ns == written
    shards = Shards(tmp_path / "a", "train")
    assert len(shards) == 4
    rgb, depth_m = shards[3]
    assert (rgb.shape, rgb.dtype) == ((240, 320, 3), np.uint8)
    assert (depth_m.shape, depth_m.dtype) == ((240, 320), np.float32)
    assert np.isfinite(depth_m).all()
    assert len(Shards(tmp_path / "a", "validation")) == 0


def test_no_two_splits_can_share_a_room():
    starts = sorted(FIRST_SEED.values())
    assert min(np.diff(starts)) >= 1_000_000


def test_zooming_shrinks_depth_by_the_factor_it_enlarges():
    depth_m = np.full((240, 320), 3.0, np.float32)
    rgb = np.zeros((240, 320, 3), np.uint8)
    rgb[:, ::20] = 255
    zoomed, nearer_m = zoom(rgb, depth_m, np.random.default_rng(0), largest=2.0)
    spacing_px = 20.0 * 3.0 / nearer_m[0, 0]
    lines = np.flatnonzero(np.diff((zoomed[120, :, 0] > 60).astype(int)) == 1)
    assert np.median(np.diff(lines)) == pytest.approx(spacing_px, abs=1.0)


def test_augmenting_keeps_size_and_leaves_the_stored_image_alone():
    rng = np.random.default_rng(0)
    rgb, depth_m = rng.integers(0, 256, (240, 320, 3), dtype=np.uint8), np.full((240, 320), 2.0, np.float32)
    before = rgb.copy()
    for _ in range(30):
        other, other_m = augment(rgb, depth_m, rng)
        assert (other.shape, other.dtype, other_m.shape) == (rgb.shape, np.uint8, depth_m.shape)
        assert 2.0 / 1.6 - 1e-6 <= other_m.min() <= other_m.max() <= 2.0
    np.testing.assert_array_equal(rgb, before)
