import numpy as np
import pytest

from pipeline.kernels.geometry import apply, inverse, rigid, rotation_exp
from pipeline.registration.anderson import Anderson, similarity_exp, similarity_log

FIXED = np.array([0.2, -0.1, 0.3, 0.5, -0.4, 0.1, 0.0])


def _affine(rates):
    """A map of poses that is affine in their logarithms, with one fixed point, and its contraction rates."""
    axes = np.linalg.qr(np.random.default_rng(2).normal(size=(6, 6)))[0]
    matrix = np.zeros((7, 7))
    matrix[:6, :6] = (axes * rates) @ axes.T
    return lambda T: similarity_exp(FIXED + matrix @ (similarity_log(T) - FIXED))


def _errors(propose, steps, mixer=None):
    """Distance of every pose from the fixed point, from the identity on."""
    T, errors = np.eye(4), []
    for _ in range(steps):
        proposed = propose(T)
        T = proposed if mixer is None else mixer.mix(T, proposed)
        errors.append(np.abs(T - similarity_exp(FIXED)).max())
    return np.array(errors)


@pytest.mark.parametrize("size", [0.0, 1e-12, 1e-6, 9.99e-3, 1.01e-2, 0.5, 3.0])
def test_logarithm_and_exponential_undo_each_other(size):
    coordinates = size * np.array([0.48, -0.6, 0.64, 1.0, -2.0, 0.5, 0.3])
    T = similarity_exp(coordinates)
    np.testing.assert_allclose(similarity_log(T), coordinates, rtol=1e-12, atol=3e-15)
    assert np.linalg.det(T[:3, :3]) == pytest.approx(np.exp(3.0 * coordinates[6]), rel=1e-12)


def test_a_turn_about_a_point_is_one_screw():
    """exp(k log T) turns about the same point by k times the angle."""
    turn = rotation_exp(np.array([0.0, 0.0, 0.3]))
    center_m = np.array([1.0, 2.0, 3.0])
    T = rigid(turn, center_m - turn @ center_m)
    thrice = similarity_exp(3.0 * similarity_log(T))
    np.testing.assert_allclose(thrice, T @ T @ T, atol=1e-14)
    np.testing.assert_allclose(apply(thrice, center_m[None])[0], center_m, atol=1e-14)


@pytest.mark.parametrize("memory", [1, 2, 3, 5])
def test_an_affine_map_is_solved_after_memory_and_one_steps(memory):
    """With m different rates, m differences of residuals span what is left (Walker, Ni 2011)."""
    rates = np.resize(np.linspace(0.5, 0.95, memory), 6)
    errors = _errors(_affine(rates), memory + 1, Anderson(memory))
    assert errors[-1] < 1e-9
    assert errors[-2] > 1e-6


def test_a_slow_contraction_becomes_fast():
    propose = _affine(np.array([0.99, 0.97, 0.9, 0.8, 0.5, 0.2]))
    plain, mixed = _errors(propose, 60), _errors(propose, 60, Anderson())
    assert plain[-1] > 0.1
    assert (mixed[15:] < 1e-9).all()


def test_the_first_call_takes_the_proposal_and_so_does_the_first_after_a_reset():
    propose, mixer = _affine(np.linspace(0.3, 0.9, 6)), Anderson()
    T_first = propose(np.eye(4))
    assert (mixer.mix(np.eye(4), T_first) == T_first).all()
    T_second = propose(T_first)
    assert np.abs(mixer.mix(T_first, T_second) - T_second).max() > 1e-3
    mixer.reset()
    assert (mixer.mix(T_first, T_second) == T_second).all()


def test_no_motion_stays_no_motion():
    mixer = Anderson()
    for _ in range(8):
        np.testing.assert_allclose(mixer.mix(np.eye(4), np.eye(4)), np.eye(4), atol=1e-15)


def test_scale_is_extrapolated_too():
    """Half of the remaining logarithm of the scale each time: two steps solve it."""
    mixer, T = Anderson(), np.eye(4)
    for _ in range(2):
        scale = np.cbrt(np.linalg.det(T[:3, :3]))
        T = mixer.mix(T, np.diag([*3 * [np.sqrt(scale * 1.2)], 1.0]))
    np.testing.assert_allclose(T, np.diag([1.2, 1.2, 1.2, 1.0]), atol=1e-12)


def test_poses_depend_neither_on_the_frame_nor_on_the_unit():
    """Written about the cloud's own centre, in units of its size."""
    propose = _affine(np.linspace(0.3, 0.9, 6))
    away = rigid(rotation_exp(np.array([0.4, 1.1, -0.7])), [3.0, -2.0, 5.0])
    into = np.diag([1000.0, 1000.0, 1000.0, 1.0]) @ away
    center_m = np.array([0.2, 0.1, 1.5])
    here = Anderson(center_m=center_m, spread_m=0.7)
    there = Anderson(center_m=apply(into, center_m[None])[0], spread_m=700.0)
    T = np.eye(4)
    for _ in range(5):
        T_next = here.mix(T, propose(T))
        T_there = there.mix(into @ T @ np.linalg.inv(into), into @ propose(T) @ np.linalg.inv(into))
        T = T_next
        np.testing.assert_allclose(np.linalg.inv(into) @ T_there @ into, T, atol=1e-9)
    np.testing.assert_allclose(T @ inverse(T), np.eye(4), atol=1e-12)
