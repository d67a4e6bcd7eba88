"""D09: the verdict on made-up errors, and a board before a sensor."""

import numpy as np
import pytest

from lab.claims.calibration import biased_sensors
from lab.claims.calibration.biased_sensors import CASES, RANGES_M, judge
from lab.worlds.depth_bias import DepthBias
from pipeline.kernels.geometry import rigid
from pipeline.types import CameraIntrinsics, DepthMap


def trials(factors, count=40):
    rng = np.random.default_rng(0)
    made = []
    for _ in range(count):
        room_cm = rng.uniform(0.4, 0.8)
        made.append(
            {name: factor * room_cm for name, factor in zip(CASES, factors, strict=True)}
            | {f"left at {away_m:g} m {node}": 0.001 for away_m in RANGES_M for node in (0, 1)}
        )
    return made


@pytest.mark.parametrize(
    ("factors", "holds"),
    [((1.0, 1.05, 6.0, 1.1), True), ((1.0, 1.05, 6.0, 1.3), False), ((1.0, 1.0, 1.1, 1.0), False)],
)
def test_the_verdict_takes_both_sides_of_the_claim(factors, holds):
    outcome = judge(trials(factors))
    assert outcome.reproduced is holds
    assert outcome.ours["ratio biased, calibrated"] == pytest.approx(factors[3])
    assert outcome.ours["median_m unbiased"] == pytest.approx(0.006, abs=0.0007)


def test_a_calibrated_session_gives_back_the_bias_of_the_sensor(monkeypatch):
    monkeypatch.setattr(biased_sensors, "VIEWS", 10)
    camera = CameraIntrinsics.pinhole(525.0, 525.0, 319.5, 239.5, 640, 480)
    nothing = DepthMap(np.ones((480, 640), np.float32))
    node = biased_sensors.Node(camera, rigid(np.eye(3), np.zeros(3)), nothing, DepthBias(a_m=0.03))
    session = biased_sensors._board_session(node, np.random.default_rng(1))
    found = session.calibrated(node.bias)
    assert biased_sensors._left_m(node, found.correction, 1.0) < 0.004
    assert biased_sensors._left_m(node, biased_sensors.DepthCorrection((640, 480)), 1.0) > 0.029
    assert found.camera.fx_px == pytest.approx(525.0, rel=0.01)
