"""Teams of training processes: their gradients' mean, and what a process that fails does to the others."""

import os
import signal
import time

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


def kill_the_waiting(team: Team, pid: torch.Tensor) -> None:
    """Wait for a step; the leader first kills the process that waits for it."""
    if team.leads:
        while not team.barrier.n_waiting:
            time.sleep(0.01)
        os.kill(int(pid), signal.SIGTERM)
    else:
        pid.fill_(os.getpid())
    team.barrier.wait()


@pytest.mark.parametrize(
    ("by", "how"),
    [
        (None, r"failed \(exit code 1\); its messages are above"),
        (signal.SIGKILL, r"was killed by SIGKILL$"),
    ],
)
def test_a_process_that_fails_stops_the_team_and_is_reported(capfd, by, how):
    with pytest.raises(PacketMeshError, match=how):
        run_team(2, 1, fail, by)
    assert ("ValueError: the leader failed" in capfd.readouterr().err) == (by is None)


def test_a_process_that_is_killed_while_it_waits_stops_the_team():
    with pytest.raises(PacketMeshError, match=r"was killed by SIGTERM$"):
        run_team(2, 1, kill_the_waiting, torch.zeros((), dtype=torch.int64).share_memory_())
