"""The job that loads a depth network, finds from its inputs whether it takes depth, and runs it once."""

from __future__ import annotations

import time
from collections.abc import Callable, Generator
from dataclasses import replace
from pathlib import Path

import numpy as np

from app.compute.state import Spec
from app.compute.store import Store
from app.screens.depth.view import ModelChoice, ModelView
from packetmesh.errors import InputError
from packetmesh.progress import Progress
from pipeline.config import DepthConfig, ModelKind
from pipeline.depth import DepthNetwork, OwnCompletion
from pipeline.depth.completion_signature import takes_depth
from pipeline.depth.sessions import modified_ns, open_session
from pipeline.types import DepthMap

TEST_IMAGE = np.dstack(np.broadcast_arrays(*np.ogrid[0:240, 0:320], 128)).astype(np.uint8)
"""(240, 320, 3) a ramp of colours, on which any network gives an answer."""
TEST_DEPTH = DepthMap(np.tile(np.linspace(1.0, 3.0, 320, dtype=np.float32), (240, 1)))
TEST_DEPTH.z_m[80:160, 120:200] = np.nan
"""A slanted wall with a hole."""


def model_job(store: Store, spec: Spec, choice: ModelChoice) -> Generator[Progress, None, ModelView]:
    """Load a network and run it on one test image; no result of the chain is needed.

    Raises:
        InputError: it is not a depth network, its kind is unknown, it rejects the image size, or a network
            that takes image and depth comes with settings for networks that take an image alone.
        ReconstructionError: its output is no depth, or does not follow the given depth.
    """
    yield Progress("loading the network", 0.3)
    choice = by_its_inputs(choice)
    config = choice.put_into(DepthConfig())
    network: DepthNetwork | OwnCompletion
    kind: ModelKind
    run: Callable[[], object]
    if config.completion is not None:
        network = own = OwnCompletion.of(config)
        kind, run = "metric", lambda: own.complete(TEST_DEPTH, TEST_IMAGE)
    else:
        network = colour = DepthNetwork.of(config)
        kind, run = colour.convention.kind, lambda: colour.infer(TEST_IMAGE)
    yield Progress("running the network", 0.6)
    started = time.perf_counter()
    run()
    return ModelView(
        choice=choice,
        kind=kind,
        provider=network.provider,
        inference_s=time.perf_counter() - started,
        size_bytes=network.model_path.stat().st_size,
        description=network.description,
    )


def by_its_inputs(choice: ModelChoice) -> ModelChoice:
    """Return the choice; a network that takes image and depth is moved from ``model`` to ``completion``.

    Raises:
        InputError: such a network comes with settings of networks that take an image alone.
    """
    if choice.model is None:
        return choice
    path = Path(choice.model)
    if not takes_depth(open_session(path, modified_ns(path))):
        return choice
    if choice != replace(ModelChoice(choice.model), normalisation=choice.normalisation):
        raise InputError(
            f"{path.name} takes image and depth; preset, output and size are for networks that take an image "
            "alone: choose 'from the file', and 0 and 0"
        )
    return ModelChoice(completion=choice.model, completion_normalisation=choice.normalisation)
