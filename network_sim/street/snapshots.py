"""Images of all vehicles, computed when they are needed.

A vehicle takes images at a fixed interval, so they are computed only when it meets an access point. The
scenario is our reconstruction (SPEC 6.2) of Bruno & Nurchis (arXiv 1311.6013).
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from network_sim.config import NetworkConfig, SchemeConfig
from network_sim.street.mobility import Routes
from network_sim.trace.log import Recorder
from network_sim.types import Cause, EventKind, to_ns


def shown_pieces(routes: Routes, scheme: SchemeConfig, vehicle: int, captured_ns: np.ndarray) -> np.ndarray:
    """Return (T, P) the pieces of road that a vehicle's images show, nearest first; -1 beyond the grid.

    A piece is ``scheme.cell_m / scheme.pieces`` of road; the first is that on which the vehicle is.
    """
    piece_m = scheme.cell_m / scheme.pieces
    return routes.cells_ahead(vehicle, captured_ns, piece_m, scheme.pieces, scheme.directed_cells)


class Snapshots:
    """Capture time and cell of each image, and the images that each vehicle still has to offer.

    The buffer of a vehicle is a FIFO (SPEC 6.2) of its latest ``scheme.buffer_images`` images. Image ``i`` of
    vehicle ``v`` has the number ``v * per_vehicle + i``.
    """

    def __init__(self, config: NetworkConfig, routes: Routes, rng: np.random.Generator) -> None:
        """Draw from ``rng`` the time of each vehicle's first image, within the first interval."""
        self._routes = routes
        self._scheme = config.scheme
        self._cell_m = config.scheme.cell_m
        self._directed = config.scheme.directed_cells
        self._capacity = config.scheme.buffer_images
        self._sample_ns = to_ns(config.scheme.sample_s)
        self.kept_ns = self._capacity * self._sample_ns
        """Time after capture for which an image stays in the buffer."""
        vehicles = config.street.vehicles
        self._first_ns: list[int] = rng.integers(self._sample_ns, size=vehicles).tolist()
        self._per_vehicle = to_ns(config.run.horizon_s) // self._sample_ns + 1
        self.arrived = bytearray(vehicles * self._per_vehicle)
        """For each image, whether the collector has it."""
        self._next = [0] * vehicles
        self._offer_later: list[set[int]] = [set() for _ in range(vehicles)]

    def offer(self, vehicle: int, now_ns: int) -> np.ndarray:
        """Return the images (T,) in the buffer that are new or must be offered again, oldest first."""
        newest = self._newest(vehicle, now_ns)
        oldest = max(newest - self._capacity + 1, 0)
        base = vehicle * self._per_vehicle
        images = np.arange(base + max(self._next[vehicle], oldest), base + newest + 1)
        self._next[vehicle] = newest + 1
        again = sorted(image for image in self._offer_later[vehicle] if image >= base + oldest)
        self._offer_later[vehicle].clear()
        return np.concatenate([np.array(again, dtype=np.int64), images]) if again else images

    def offer_later(self, vehicle: int, images: Iterable[int]) -> None:
        """Offer these images again at the next contact: they were not collected."""
        self._offer_later[vehicle].update(images)

    def tags(self, vehicle: int, images: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return cells (T,) and capture times in ns (T,) of a vehicle's images."""
        captured_ns = self._first_ns[vehicle] + (images - vehicle * self._per_vehicle) * self._sample_ns
        return self._routes.cells(vehicle, captured_ns, self._cell_m, self._directed), captured_ns

    def pieces(self, vehicle: int, captured_ns: np.ndarray) -> np.ndarray:
        """Return (T, P) the pieces of road that a vehicle's images of these times show; -1 shows none."""
        return shown_pieces(self._routes, self._scheme, vehicle, captured_ns)

    def record(self, recorder: Recorder, now_ns: int, image_bytes: int) -> None:
        """Record all images taken so far, and those that a full buffer dropped before their arrival."""
        arrived = np.frombuffer(self.arrived, dtype=bool)
        for vehicle in range(len(self._first_ns)):
            count = self._newest(vehicle, now_ns) + 1
            images = vehicle * self._per_vehicle + np.arange(count)
            cells, captured_ns = self.tags(vehicle, images)
            recorder.add_many(
                captured_ns, EventKind.CAPTURE, vehicle, peer=cells, image=images, size_bytes=image_bytes
            )
            old = images[: max(count - self._capacity, 0)]
            lost = ~arrived[old]
            recorder.add_many(
                captured_ns[self._capacity :][lost],
                EventKind.EXPIRE,
                vehicle,
                image=old[lost],
                size_bytes=image_bytes,
                cause=Cause.BUFFER,
            )

    def _newest(self, vehicle: int, now_ns: int) -> int:
        return (now_ns - self._first_ns[vehicle]) // self._sample_ns
