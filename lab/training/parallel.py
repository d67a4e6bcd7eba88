"""Data-parallel training: several processes average their gradients after every step.

On shared cores this loses far less time than torch's threads, which wait for each other after every layer.
"""

from __future__ import annotations

import os
import signal
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from multiprocessing.connection import wait
from typing import Any

import torch
import torch.multiprocessing as mp
from torch import Tensor, nn

from packetmesh.errors import PacketMeshError


@dataclass(slots=True)
class Team:
    """A process's rank in its team, and the memory that the team shares."""

    rank: int
    size: int
    gradients: Tensor
    """(2, size, parameters): two slots, so that a step can be written while the previous one is read."""
    clock_s: Tensor
    """(2,) float64, the leader's time in either slot."""
    barrier: Any

    @property
    def leads(self) -> bool:
        """Whether this process keeps the log and the checkpoints."""
        return self.rank == 0

    def average_gradients(self, parameters: Iterable[nn.Parameter], step: int, now_s: float) -> float:
        """Replace every gradient by the team's mean; return the leader's ``now_s``, in all processes."""
        slot = step % 2
        grads = [p.grad for p in parameters if p.grad is not None]
        torch.cat([grad.reshape(-1) for grad in grads], out=self.gradients[slot, self.rank])
        if self.leads:
            self.clock_s[slot] = now_s
        self.barrier.wait()
        mean = self.gradients[slot].mean(dim=0)
        for grad, part in zip(grads, mean.split([grad.numel() for grad in grads]), strict=True):
            grad.copy_(part.view(grad.shape))
        return float(self.clock_s[slot])


def run_team(size: int, parameters: int, work: Callable[..., None], *arguments: object) -> None:
    """Run ``work(team, *arguments)`` in ``size`` processes of one thread each, until all have stopped.

    If a process fails or is killed, the others are killed; the traceback of an exception is printed.

    Args:
        size: number of processes.
        parameters: number of parameters of the trained network, all of which get gradients.
        work: called in each process.
        arguments: further arguments of ``work``.

    Raises:
        PacketMeshError: a process failed or was killed.
    """
    context = mp.get_context("spawn")
    gradients = torch.zeros(2, size, parameters).share_memory_()
    clock_s = torch.zeros(2, dtype=torch.float64).share_memory_()
    barrier = context.Barrier(size)
    teams = [Team(rank, size, gradients, clock_s, barrier) for rank in range(size)]
    processes = [context.Process(target=_member, args=(team, work, arguments)) for team in teams]
    for process in processes:
        process.start()
    running = {process.sentinel: process for process in processes}
    failure = 0
    while running:
        for sentinel in wait(list(running)):
            process = running.pop(sentinel)
            process.join()
            if process.exitcode and not failure:
                failure = process.exitcode
                for other in running.values():  # to abort the barrier would wait for a dead process in it
                    other.kill()
    if failure:
        how = (
            f"was killed by {signal.Signals(-failure).name}"
            if failure < 0
            else f"failed (exit code {failure}); its messages are above"
        )
        raise PacketMeshError(f"The training stopped because a process {how}")


def _member(team: Team, work: Callable[..., None], arguments: tuple[object, ...]) -> None:
    os.setsid()  # a scheduling group of its own, if the kernel divides time by session
    torch.set_num_threads(1)
    work(team, *arguments)
