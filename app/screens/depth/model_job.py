"""The job that loads a depth network and tries it once before it is used."""

from __future__ import annotations

import time
from collections.abc import Generator

import numpy as np

from app.compute.state import Spec
from app.compute.store import Store
from app.screens.depth.view import ModelChoice, ModelView
from packetmesh.progress import Progress
from pipeline.config import DepthConfig
from pipeline.depth import DepthNetwork

TEST_IMAGE = np.dstack(np.broadcast_arrays(*np.ogrid[0:240, 0:320], 128)).astype(np.uint8)
"""(240, 320, 3) a ramp of colours, on which any network gives an answer."""


def model_job(store: Store, spec: Spec, choice: ModelChoice) -> Generator[Progress, None, ModelView]:
    """Load a network and infer one image, without results of the chain.

    Raises:
        InputError: it is no depth network, its kind is unknown, or it does not take the size.
        ReconstructionError: its answer is no depth.
    """
    yield Progress("loading the network", 0.3)
    network = DepthNetwork.of(choice.put_into(DepthConfig()))
    yield Progress("running the network", 0.6)
    started = time.perf_counter()
    network.infer(TEST_IMAGE)
    return ModelView(
        choice=choice,
        kind=network.convention.kind,
        provider=network.provider,
        inference_s=time.perf_counter() - started,
        size_bytes=network.model_path.stat().st_size,
        description=network.description,
    )
