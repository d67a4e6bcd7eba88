"""Every texture is a deterministic albedo, inside 0 to 1, that differs by seed and place."""

import numpy as np
import pytest

from lab.worlds import textures
from lab.worlds.textures.mixing import linear
from lab.worlds.textures.noise import cell_random, face_uv, fbm

A, B, C = (0.6, 0.4, 0.2), (0.2, 0.1, 0.05), (0.1, 0.3, 0.5)
MAKERS = {
    "paint": lambda s: textures.paint(A, s),
    "plaster": lambda s: textures.plaster(A, s),
    "concrete": lambda s: textures.concrete(A, s),
    "wood": lambda s: textures.wood(A, B, s),
    "planks": lambda s: textures.planks(A, B, s),
    "parquet": lambda s: textures.parquet(A, B, s),
    "tiles": lambda s: textures.tiles(A, B, s),
    "brick": lambda s: textures.brick(A, B, s),
    "carpet": lambda s: textures.carpet(A, s),
    "fabric": lambda s: textures.fabric(A, B, s),
    "stripes": lambda s: textures.stripes(A, B, s),
    "motif": lambda s: textures.motif(A, B, s),
    "checker": lambda s: textures.checker(A, B, 0.1, s),
    "rug": lambda s: textures.rug([A, B, C], s),
    "marble": lambda s: textures.marble(A, B, s),
    "brushed_metal": lambda s: textures.brushed_metal(A, s),
    "patches": lambda s: textures.patches([A, B, C], s),
    "painting": textures.painting,
    "paper": textures.paper,
    "cardboard": lambda s: textures.cardboard(seed=s),
    "leaf": lambda s: textures.leaf(A, s),
    "display": lambda s: textures.display(s, (0.5, 0.3)),
    "outdoors": textures.outdoors,
}


def _places(count: int = 4000) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(0)
    return rng.uniform(-1.5, 1.5, (count, 3)).astype(np.float32), np.eye(3, dtype=np.float32)[
        rng.integers(3, size=count)
    ]


@pytest.mark.parametrize("name", MAKERS)
def test_albedo_is_deterministic_bounded_varied_and_seeded(name: str) -> None:
    places, normals = _places()
    first, again, other = (MAKERS[name](s)(places, normals) for s in (5, 5, 6))
    assert first.shape == (len(places), 3)
    assert np.all((first >= 0.0) & (first <= 1.0))
    np.testing.assert_array_equal(first, again)
    assert np.any(first != other)
    assert first.std(axis=0).max() > 0.005


@pytest.mark.parametrize("name", MAKERS)
def test_albedo_of_a_place_does_not_depend_on_its_neighbours_in_the_batch(name: str) -> None:
    places, normals = _places(200)
    texture = MAKERS[name](3)
    np.testing.assert_allclose(texture(places, normals)[::7], texture(places[::7], normals[::7]), atol=1e-6)


def test_solid_is_its_colour_and_srgb_grey_is_linear() -> None:
    np.testing.assert_allclose(textures.solid(A)(*_places(5)), np.tile(A, (5, 1)), rtol=1e-6)
    np.testing.assert_allclose(linear("#00ff80"), [0.0, 1.0, 0.21586], atol=1e-5)


def test_every_texture_on_offer_is_tested_here() -> None:
    assert set(textures.__all__) - {"random_palette", "solid"} == set(MAKERS)


def test_noise_is_continuous_centred_and_between_0_and_1() -> None:
    places, _ = _places(50_000)
    value = fbm(places, 0.1, 1, 3)
    assert value.min() >= 0.0
    assert value.max() <= 1.0
    assert value.mean() == pytest.approx(0.5, abs=0.03)
    assert np.abs(fbm(places + np.float32(1e-4), 0.1, 1, 1) - fbm(places, 0.1, 1, 1)).max() < 0.01


def test_cell_numbers_are_uniform_and_uncorrelated() -> None:
    i, j = (axis.ravel().astype(np.float32) for axis in np.mgrid[-100:100, -100:100])
    value = cell_random(i, j, 7).reshape(200, 200)
    assert value.mean() == pytest.approx(0.5, abs=0.01)
    assert value.std() == pytest.approx(1.0 / np.sqrt(12.0), abs=0.01)
    for shifted in (value[1:], value[:, 1:].T):
        other = value[:-1] if shifted.shape == value[1:].shape else value[:, :-1].T
        assert abs(np.corrcoef(shifted.ravel(), other.ravel())[0, 1]) < 0.03


def test_v_is_up_on_walls() -> None:
    place = np.array([[1.0, 2.0, 3.0]])
    for axis, uv in ((0, (2.0, 3.0)), (1, (1.0, 3.0)), (2, (1.0, 2.0))):
        for sign in (-1.0, 1.0):
            np.testing.assert_array_equal(face_uv(place, sign * np.eye(3)[axis : axis + 1]), [uv])
