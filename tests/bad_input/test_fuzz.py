"""Good files with a few bytes changed: whatever they are then, they open or get one sentence."""

import contextlib

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from packetmesh.errors import PacketMeshError
from packetmesh.memory import at_most_further
from tests.bad_input.samples import samples

SLOW = ("a.bag", "a.db3", "a.mcap", "a.onnx", "a.e57", "packed.pcd")
"""Their libraries are others' own, or take too long to be opened so often."""
EXAMPLES = 25
FUZZED = [sample for sample in samples() if sample.name not in SLOW]
Changes = list[tuple[float, bytes]]


@pytest.mark.timeout(120)
@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("sample", FUZZED, ids=lambda sample: sample.name)
def test_a_changed_file_opens_or_gets_one_sentence(sample, tmp_path_factory):
    path = tmp_path_factory.mktemp("fuzz") / sample.name
    path.parent.mkdir(parents=True, exist_ok=True)

    @settings(max_examples=EXAMPLES, derandomize=True, suppress_health_check=list(HealthCheck))
    @given(
        changes=st.lists(
            st.tuples(st.floats(0.0, 1.0), st.binary(min_size=1, max_size=8)), min_size=1, max_size=4
        ),
        end=st.floats(0.3, 1.0) | st.just(1.0),
    )
    def check(changes: Changes, end: float) -> None:
        data = bytearray(sample.data)
        for share, new in changes:
            at = int(share * len(data))
            data[at : at + len(new)] = new
        path.write_bytes(bytes(data[: int(end * len(data))]))
        with at_most_further(2 << 30), contextlib.suppress(PacketMeshError):
            sample.read(path)

    check()
