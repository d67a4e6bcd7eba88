"""The completion network's loss: the likelihood of the true differences under its output."""

from __future__ import annotations

import torch
from torch import Tensor

from pipeline.depth.slopes import DISTANCES, LOG_SCALES

MEASURED_WEIGHT = 0.1
"""Weight of differences between two measured pixels, which completion does not use."""


def negative_log_likelihood(output: Tensor, planes: Tensor, start: Tensor, log_z: Tensor) -> Tensor:
    """Return the mean of |x - m| / b + log b over unknown pixels and differences, all kinds weighted equally.

    Laplace's distribution is used so that a possible edge widens b and does not move m.

    Args:
        output: (N, 14, H, W) of the network.
        planes: (N, 8, H, W) its input; the fourth is the mask of measured pixels.
        start: (N, H, W) logarithmic depth that the first output corrects.
        log_z: (N, H, W) the truth, NaN where there is none.

    Returns:
        A scalar.
    """
    there, known = torch.isfinite(log_z), planes[:, 3] > 0.5
    true = torch.where(there, log_z, 0.0)
    terms = [weighted(true - start - output[:, 0], output[:, 1], (there & ~known).float())]
    channel = 2
    for distance in DISTANCES:
        for axis in (2, 1):
            size = true.shape[axis] - distance
            near, far = (lambda x, at=at, n=size, a=axis: x.narrow(a, at, n) for at in (0, distance))
            weight = torch.where(near(known) & far(known), MEASURED_WEIGHT, 1.0)
            weight = weight * (near(there) & far(there))
            error = far(true) - near(true) - near(output[:, channel])
            terms.append(weighted(error, near(output[:, channel + 1]), weight))
            channel += 2
    return torch.stack(terms).mean()


def weighted(error: Tensor, log_scale: Tensor, weight: Tensor) -> Tensor:
    """Return the weighted mean of Laplace's negative log likelihood, without its constant."""
    log_scale = log_scale.clamp(*LOG_SCALES)
    cost = error.abs() * torch.exp(-log_scale) + log_scale
    return (cost * weight).sum() / weight.sum().clamp(min=1.0)
