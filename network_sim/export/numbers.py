"""Sequence numbers of the frames in a capture."""

from __future__ import annotations

from network_sim.export.contents import OnAir


class LastNumbers:
    """Sequence numbers of each sender, from 0: a packet keeps its number when it is sent again.

    A node that was down hands its packet to the medium access anew, which gives it a new number.
    """

    def __init__(self, count: int) -> None:
        self._count = count
        self._packets: dict[int, int] = {}
        self._latest: dict[int, int] = {}

    def of(self, row: OnAir) -> tuple[int, bool]:
        """Return the number of a data frame, and whether the frame was sent before."""
        if self._packets.get(row.node) == row.packet:
            return self._latest[row.node], True
        self._packets[row.node] = row.packet
        self._latest[row.node] = number = (self.latest(row.node) + 1) % self._count
        return number, False

    def latest(self, node: int) -> int:
        """Return the number of a node's last data frame; -1 before its first."""
        return self._latest.get(node, -1)

    def forget(self, node: int) -> None:
        """Give the next data frame of a node a new number."""
        self._packets.pop(node, None)


class WindowNumbers:
    """Sequence numbers from each sender to each receiver, from 0, where several packets are under way.

    A packet keeps its number when it is sent again, unless its node was down in between, as in
    ``LastNumbers``.
    """

    def __init__(self, count: int) -> None:
        self._count = count
        self._packets: dict[tuple[int, int], int] = {}
        self._next: dict[tuple[int, int], int] = {}

    def of(self, row: OnAir) -> tuple[int, bool]:
        """Return the number of a data frame, and whether the frame was sent before."""
        known = self._packets.get((row.node, row.packet))
        if known is not None:
            return known, True
        number = self._next.get((row.node, row.peer), 0)
        self._packets[row.node, row.packet] = number
        self._next[row.node, row.peer] = (number + 1) % self._count
        return number, False

    def forget(self, node: int) -> None:
        """Give all packets that a node sends from now on new numbers."""
        self._packets = {key: number for key, number in self._packets.items() if key[0] != node}
