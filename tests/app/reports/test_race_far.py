"""A race far from the origin: the page's 32-bit numbers keep the clouds in their places to each other."""

import zlib

import numpy as np

from app.reports import race as page
from app.reports.hand_out import Viewpoint
from pipeline.kernels.geometry import apply, rigid, rotation_exp

RNG = np.random.default_rng(2)
POSE = rigid(rotation_exp(np.array([0.1, -0.2, 0.3])), [0.4, 0.2, -0.1])
PLACE = np.array([500_000.0, 5_400_000.0, 100.0])


def shown(monkeypatch, away_m):
    """What the page draws: source and target as seen from the eye, from the numbers that it stores."""
    kept = {}
    monkeypatch.setattr(page, "offline_page", lambda *parts: kept.update(record=parts[4], packed=parts[5]))
    source = RNG.random((50, 3)) + away_m
    T = rigid(np.eye(3), away_m) @ POSE @ rigid(np.eye(3), -away_m)
    empty = np.zeros((1, 50), np.uint8)
    run = page.RaceRun("icp", (1, 2, 3), T[None], np.zeros(1), ("",), ("",), None, empty, ())
    view = Viewpoint(away_m - [5.0, 0.0, 0.0], away_m, np.array([0.0, 0.0, 1.0]))
    target = apply(T, source)
    page.race_page(page.RaceShow("t", "s", source, target, view, (run,), None, 1.0, ("", "", "")))
    stored = {
        name: np.frombuffer(zlib.decompress(kept["packed"][name]), "<f4").reshape(-1, 3).astype(float)
        for name in ("source", "target")
    }
    pose = np.array(kept["record"]["runs"][0]["poses"][0]).reshape(4, 4).T
    eye = np.array(kept["record"]["view"]["eye_m"])
    return apply(pose, stored["source"]) - eye, stored["target"] - eye, target - view.eye_m


def test_clouds_far_from_the_origin_meet_as_they_do_near_it(monkeypatch):
    for away_m in (np.zeros(3), PLACE):
        source, target, true = shown(monkeypatch, away_m)
        np.testing.assert_allclose(source, true, atol=1e-4)
        np.testing.assert_allclose(target, true, atol=1e-4)
