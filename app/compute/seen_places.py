"""Reconstructed places for planning cameras, of which each computing process keeps the newest."""

from __future__ import annotations

from collections.abc import Generator, Hashable
from dataclasses import dataclass

from app.compute.store import Store
from packetmesh.progress import Progress
from pipeline.planning.places import floor_m
from pipeline.planning.seen import SeenPlace, seen_place
from pipeline.reconstruct import Reconstruction, iterate_reconstruction
from pipeline.spec import Spec, key


@dataclass(frozen=True, slots=True)
class Place:
    """A reconstruction, and what its cameras know of the place."""

    done: Reconstruction
    seen: SeenPlace
    floor_m: float
    """Height of the floor."""


_newest: dict[str, tuple[Hashable, Place]] = {}
"""By the store's folder: the last place that this process used. Its ray scenes cannot be pickled."""


def place_of(store: Store, spec: Spec) -> Generator[Progress, None, Place]:
    """Return the place of a spec; reports no progress if this process used it last.

    Raises:
        PacketMeshError: the images give no surface.
    """
    wanted = key(spec, "truth")
    held, place = _newest.get(store.folder, (None, None))
    if place is None or held != wanted:
        done = yield from iterate_reconstruction(spec, store)
        yield Progress("what the cameras see", 0.95)
        seen = seen_place(done)
        place = Place(done, seen, floor_m(seen))
        _newest[store.folder] = wanted, place
    return place
