"""Learning depth from a moving camera alone: the photometric loss of SPEC 3.3 (Godard et al. 2019).

A neighbouring frame (source) is warped onto the frame whose depth is wanted (target) with that depth, the
camera matrix and the motion that a small network sees between the two; what does not look alike costs.
Needs sequences with known intrinsics and no depth at all; the scale of the depth stays unknown.
"""

from __future__ import annotations

import torch
from torch import Tensor, nn

from lab.training.losses import SMOOTHNESS, smoothness

SSIM_SHARE = 0.85
SSIM_C1, SSIM_C2 = 0.01**2, 0.03**2
POSE_SCALE = 0.01
POSE_CHANNELS = (16, 32, 64, 128, 256)
NEAREST_M = 1e-3


class PoseNet(nn.Module):
    """Two images to the motion between their cameras: axis-angle (radians) and translation, six numbers."""

    def __init__(self) -> None:
        super().__init__()
        layers: list[nn.Module] = []
        channels = 6
        for width in POSE_CHANNELS:
            layers += [nn.Conv2d(channels, width, 3, 2, 1), nn.ReLU(inplace=True)]
            channels = width
        self.layers = nn.Sequential(*layers, nn.Conv2d(channels, 6, 1))

    def forward(self, target: Tensor, source: Tensor) -> Tensor:
        """T_source_target (N, 4, 4) of images (N, 3, H, W) in 0 to 1; near the identity before training."""
        motion = POSE_SCALE * self.layers(torch.cat([target, source], dim=1) - 0.5).mean(dim=(2, 3))
        return transform(motion[:, :3], motion[:, 3:])


def transform(axis_angle: Tensor, translation: Tensor) -> Tensor:
    """(N, 3) radians and (N, 3) to rigid transforms (N, 4, 4); differentiable at no rotation too."""
    x, y, z = axis_angle.unbind(dim=1)
    zero = torch.zeros_like(x)
    skew = torch.stack([zero, -z, y, z, zero, -x, -y, x, zero], dim=1).view(-1, 3, 3)
    top = torch.cat([torch.linalg.matrix_exp(skew), translation[:, :, None]], dim=2)
    bottom = top.new_tensor([0.0, 0.0, 0.0, 1.0]).expand(len(top), 1, 4)
    return torch.cat([top, bottom], dim=1)


def warp(source: Tensor, depth_m: Tensor, K: Tensor, T_source_target: Tensor) -> Tensor:
    """What the target camera would see if every pixel had the source's colour of its point.

    Args:
        source: (N, 3, H, W).
        depth_m: (N, 1, H, W) of the target.
        K: (N, 3, 3) camera matrix in pixels, whole numbers at pixel centres, the same for both images.
        T_source_target: (N, 4, 4) takes points of the target's camera to the source's.

    Returns:
        (N, 3, H, W), bilinear; outside of the source its border goes on.
    """
    height, width = depth_m.shape[2:]
    v, u = torch.meshgrid(
        torch.arange(height, device=depth_m.device, dtype=depth_m.dtype),
        torch.arange(width, device=depth_m.device, dtype=depth_m.dtype),
        indexing="ij",
    )
    rays = torch.linalg.solve(K, torch.stack([u, v, torch.ones_like(u)]).view(3, -1))
    points = T_source_target[:, :3, :3] @ (rays * depth_m.flatten(2)) + T_source_target[:, :3, 3:]
    pixels = K @ points
    pixels = pixels[:, :2] / pixels[:, 2:].clamp(min=NEAREST_M)
    size = torch.tensor([[width], [height]], device=pixels.device, dtype=pixels.dtype)
    grid = ((2.0 * pixels + 1.0) / size - 1.0).view(-1, 2, height, width).permute(0, 2, 3, 1)
    return nn.functional.grid_sample(source, grid, padding_mode="border", align_corners=False)


def photometric_error(a: Tensor, b: Tensor) -> Tensor:
    """0.85 (1 - SSIM) / 2 + 0.15 |a - b| of images (N, 3, H, W) in 0 to 1, per pixel (N, 1, H, W)."""
    return (SSIM_SHARE * 0.5 * (1.0 - ssim(a, b)) + (1.0 - SSIM_SHARE) * (a - b).abs()).mean(1, keepdim=True)


def ssim(a: Tensor, b: Tensor) -> Tensor:
    """Structural similarity in 3 x 3 windows, -1 to 1 (Wang et al. 2004), of the same shape as the images."""

    def blurred(x: Tensor) -> Tensor:
        return nn.functional.avg_pool2d(nn.functional.pad(x, (1, 1, 1, 1), mode="reflect"), 3, 1)

    mean_a, mean_b = blurred(a), blurred(b)
    variance_a, variance_b = blurred(a * a) - mean_a**2, blurred(b * b) - mean_b**2
    covariance = blurred(a * b) - mean_a * mean_b
    likeness = (2 * mean_a * mean_b + SSIM_C1) * (2 * covariance + SSIM_C2)
    return likeness / ((mean_a**2 + mean_b**2 + SSIM_C1) * (variance_a + variance_b + SSIM_C2))


def least_error(target: Tensor, images: list[Tensor]) -> Tensor:
    """Per pixel, the error of the image that looks most alike there: an occluded pixel is seen by another."""
    return torch.stack([photometric_error(target, image) for image in images]).amin(dim=0)


def moving(target: Tensor, sources: list[Tensor], error: Tensor) -> Tensor:
    """(N, 1, H, W) bool: pixels that warping explains better than the unwarped sources do.

    The others stand still, move along with the camera, or have no texture, and would teach nothing.
    """
    return error < least_error(target, sources)


def selfsupervised_loss(
    depths_m: list[Tensor], target: Tensor, sources: list[Tensor], K: Tensor, poses: list[Tensor]
) -> Tensor:
    """The loss of one batch, a scalar.

    Args:
        depths_m: predictions (N, 1, H/s, W/s) of the target at strides s = 1, 2, 4, 8.
        target: (N, 3, H, W), 0 to 1.
        sources: its neighbours in time, of the same shape.
        K: (N, 3, 3) camera matrix in pixels of the target.
        poses: T_source_target (N, 4, 4) of every source.
    """
    loss = target.new_zeros(())
    for level, depth_m in enumerate(depths_m):
        full_m = 1.0 / nn.functional.interpolate(1.0 / depth_m, target.shape[2:], mode="bilinear")
        error = least_error(target, [warp(s, full_m, K, T) for s, T in zip(sources, poses, strict=True)])
        kept = moving(target, sources, error)
        image = nn.functional.interpolate(target, depth_m.shape[2:], mode="area")
        loss = loss + (error * kept).sum() / kept.sum().clamp(min=1)
        loss = loss + SMOOTHNESS / 2**level * smoothness(depth_m, image)
    return loss / len(depths_m)
