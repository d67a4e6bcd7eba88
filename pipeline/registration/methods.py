"""The registration methods by name, as ``pipeline.config.METHODS`` lists them."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module

from pipeline import config
from pipeline.registration.weighting import PairWeighting
from pipeline.types import PointCloud

MethodStart = Callable[[config.RegistrationConfig, PointCloud, PointCloud], PairWeighting]
"""Function that returns a method's first state from the config, the thinned source and the thinned target."""


def _start_of(place: str) -> MethodStart:
    """Return the function ``starting`` of the class at ``module.Class`` in this package."""
    module, _, name = place.partition(".")
    start: MethodStart = getattr(import_module(f"pipeline.registration.{module}"), name).starting
    return start


METHODS: dict[str, MethodStart] = {name: _start_of(place) for name, place in config.METHODS.items()}
"""All methods by their names in the settings."""
