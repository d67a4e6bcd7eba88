"""Teams of training processes: their gradients' mean, and what a process that fails does to the others."""

import os
import signal

import pytest

torch = pytest.importorskip("torch", reason="torch is installed only to train (see requirements-train.lock)")

from lab.training.parallel import Team, run_team  # noqa: E402
from packetmesh.errors import PacketMeshError  # noqa: E402

STEPS = 3


def descend(team: Team, weights: torch.Tensor) -> None:
    """Take a step against the mean of gradients that are the ranks plus one; write the weight."""
    weight = torch.nn.Parameter(torch.zeros(1))
    for step in range(STEPS):
        weight.grad = torch.full((1,), team.rank + 1.0)
        team.average_gradients([weight], step, 0.0)
        weight.data -= weight.grad
    weights[team.rank] = weight.item()


def fail(team: Team, by: signal.Signals | None) -> None:
    """Wait for the next step of a process that raises an exception or is killed."""
    if not team.leads:
        team.barrier.wait()
    elif by is None:
        raise ValueError("the leader failed")
    else:
        os.kill(os.getpid(), by)


def test_a_team_descends_the_mean_gradient(capfd):
    weights = torch.zeros(2).share_memory_()
    run_team(2, 1, descend, weights)
    assert weights.tolist() == [-1.5 * STEPS] * 2
    assert "Traceback" not in capfd.readouterr().err


@pytest.mark.parametrize(("by", "code"), [(None, 1), (signal.SIGKILL, -9)])
def test_a_process_that_fails_stops_the_team_and_is_reported(capfd, by, code):
    with pytest.raises(PacketMeshError, match=rf"exit code {code}\)"):
        run_team(2, 1, fail, by)
    assert ("ValueError: the leader failed" in capfd.readouterr().err) == (by is None)
