"""The supervised loss of SPEC 3.3: scale-invariant logarithmic error, its gradients, smoothness."""

from __future__ import annotations

import torch
from torch import Tensor

from lab.training.config import Loss

SCALE_INVARIANCE = 0.85
SMOOTHNESS = 1e-3
BERHU_SHARE = 0.2


def supervised_loss(
    depths_m: list[Tensor], target_m: Tensor, image: Tensor, kind: Loss = "scale-invariant"
) -> Tensor:
    """Return the loss of one batch, a scalar.

    Args:
        depths_m: predictions (N, 1, H/s, W/s) at strides s = 1, 2, 4, 8.
        target_m: (N, 1, H, W) true depth, NaN where unknown.
        image: (N, 3, H, W), normalised in any way; edges in it reduce the smoothness term.
        kind: loss of the depth values; the terms of gradients and smoothness are the same for both kinds.
    """
    loss = target_m.new_zeros(())
    for level, depth_m in enumerate(depths_m):
        target = target_m[..., :: 2**level, :: 2**level]
        valid = torch.isfinite(target)
        error = torch.where(valid, depth_m.log() - torch.where(valid, target, 1.0).log(), 0.0)
        if kind == "berhu":
            data = berhu(torch.where(valid, depth_m - torch.where(valid, target, 1.0), 0.0), valid)
        else:
            data = scale_invariant(error, valid)
        loss = loss + data / len(depths_m) + 0.5 * gradient_error(error, valid)
    return loss + SMOOTHNESS * smoothness(depths_m[0], image)


def scale_invariant(error: Tensor, valid: Tensor) -> Tensor:
    """Return the mean over images of 10 sqrt(mean(g^2) - 0.85 mean(g)^2) (Eigen et al. 2014).

    Args:
        error: (N, 1, H, W) g, predicted minus true log depth; 0 where unknown.
        valid: (N, 1, H, W) True where the truth is known.
    """
    count = valid.sum(dim=(1, 2, 3)).clamp(min=1)
    mean = error.sum(dim=(1, 2, 3)) / count
    mean_square = error.square().sum(dim=(1, 2, 3)) / count
    return 10.0 * (mean_square - SCALE_INVARIANCE * mean.square() + 1e-6).sqrt().mean()


def berhu(error_m: Tensor, valid: Tensor) -> Tensor:
    """Return the mean of |x|, or of (x^2 + c^2) / 2c where |x| > c = 0.2 max |x| (Laina et al. 2016)."""
    size_m = error_m.abs()
    limit_m = (BERHU_SHARE * size_m.detach().max()).clamp(min=1e-6)
    cost = torch.where(size_m <= limit_m, size_m, (size_m.square() + limit_m.square()) / (2.0 * limit_m))
    return cost.sum() / valid.sum().clamp(min=1)


def gradient_error(error: Tensor, valid: Tensor) -> Tensor:
    """Return mean |dx g| + mean |dy g| of log errors g over neighbouring pixels that both have a target."""
    total = error.new_zeros(())
    for axis in (2, 3):
        size = error.shape[axis] - 1
        both = valid.narrow(axis, 0, size) & valid.narrow(axis, 1, size)
        total = total + (error.diff(dim=axis).abs() * both).sum() / both.sum().clamp(min=1)
    return total


def smoothness(depth_m: Tensor, image: Tensor) -> Tensor:
    """Return the mean edge-aware first differences of mean-normalised disparity (Godard et al. 2019)."""
    disparity = 1.0 / depth_m
    disparity = disparity / disparity.mean(dim=(2, 3), keepdim=True)
    total = depth_m.new_zeros(())
    for axis in (2, 3):
        edge = image.diff(dim=axis).abs().mean(dim=1, keepdim=True)
        total = total + (disparity.diff(dim=axis).abs() * torch.exp(-edge)).mean()
    return total
