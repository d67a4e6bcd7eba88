"""One small office, reconstructed and judged once."""

from dataclasses import dataclass

import pytest

from packetmesh.progress import drain
from pipeline.planning.calls import registered
from pipeline.planning.plan import Candidates, iterate_candidates
from pipeline.planning.seen import SeenPlace, seen_place
from pipeline.planning.sensors import Sensor, sensor_named
from pipeline.reconstruct import Reconstruction, reconstruct
from pipeline.types import Rig
from tests.pipeline.delivery.small import CONFIG, small_rig


@dataclass(frozen=True)
class Office:
    """Everything from which plans are made."""

    done: Reconstruction
    rig: Rig
    seen: SeenPlace
    sensor: Sensor
    judged: Candidates


@pytest.fixture(scope="session")
def office():
    done = reconstruct(small_rig(), CONFIG)
    seen, sensor = seen_place(done), sensor_named("as-present", done.rig)
    judged = drain(iterate_candidates(seen, sensor, ("walls", "tripods")))
    return Office(done, registered(done), seen, sensor, judged)
