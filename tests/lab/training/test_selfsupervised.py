import numpy as np
import pytest

torch = pytest.importorskip("torch", reason="torch is installed only to train (see requirements-train.lock)")

from lab.training.selfsupervised import (  # noqa: E402
    PoseNet,
    least_error,
    moving,
    photometric_error,
    selfsupervised_loss,
    ssim,
    transform,
    warp,
)

HEIGHT, WIDTH, FOCAL_PX = 48, 64, 60.0
K = torch.tensor([[[FOCAL_PX, 0.0, 31.5], [0.0, FOCAL_PX, 23.5], [0.0, 0.0, 1.0]]])
STILL = torch.eye(4)[None]


def _wallpaper(shift_px: float = 0.0) -> torch.Tensor:
    """A smooth pattern on a plane, (1, 3, H, W) in 0 to 1, seen with everything ``shift_px`` to the right."""
    v, u = torch.meshgrid(torch.arange(float(HEIGHT)), torch.arange(float(WIDTH)) - shift_px, indexing="ij")
    waves = [torch.sin(u / 5.0 + k) * torch.cos(v / 7.0 - k) for k in range(3)]
    return 0.5 + 0.4 * torch.stack(waves)[None]


def _sideways(distance_m: float) -> torch.Tensor:
    return transform(torch.zeros(1, 3), torch.tensor([[distance_m, 0.0, 0.0]]))


def _pyramid(depth_m: torch.Tensor) -> list[torch.Tensor]:
    return [depth_m[..., :: 2**s, :: 2**s].clone() for s in range(4)]


def test_an_axis_and_an_angle_turn_by_the_right_hand():
    T = transform(torch.tensor([[0.0, 0.0, np.pi / 2], [0.3, -0.2, 0.1]]), torch.tensor([[1.0, 2, 3]] * 2))
    torch.testing.assert_close(T[0, :3, 0], torch.tensor([0.0, 1.0, 0.0]), atol=1e-6, rtol=0)
    torch.testing.assert_close(T[:, :3, 3], torch.tensor([[1.0, 2, 3]] * 2))
    torch.testing.assert_close(T[1, :3, :3] @ T[1, :3, :3].T, torch.eye(3), atol=1e-6, rtol=0)
    angle = torch.arccos((torch.trace(T[1, :3, :3]) - 1) / 2)
    assert angle.item() == pytest.approx(np.sqrt(0.14), rel=1e-4)


def test_a_camera_that_stands_still_sees_the_same_image():
    image, depth_m = torch.rand(1, 3, HEIGHT, WIDTH), 0.5 + torch.rand(1, 1, HEIGHT, WIDTH)
    seen = warp(image, depth_m, K, STILL)
    torch.testing.assert_close(seen, image, atol=1e-4, rtol=0)
    assert photometric_error(seen, image).max() < 1e-4
    assert photometric_error(image, image).abs().max() < 1e-6


@pytest.mark.parametrize("shift_px", [4.0, -3.5])
def test_a_plane_seen_from_the_side_warps_back_onto_the_target(shift_px):
    distance_m = 2.0
    target, source = _wallpaper(), _wallpaper(shift_px)
    T_source_target = _sideways(shift_px * distance_m / FOCAL_PX)
    seen = warp(source, torch.full((1, 1, HEIGHT, WIDTH), distance_m), K, T_source_target)
    inside = np.s_[..., 5:-5]
    assert (seen - target)[inside].abs().max() < 1e-2
    assert (source - target)[inside].abs().max() > 0.2
    wrong = warp(source, torch.full((1, 1, HEIGHT, WIDTH), 3.0), K, T_source_target)
    assert (
        photometric_error(wrong, target)[inside].mean() > 20 * photometric_error(seen, target)[inside].mean()
    )


def test_turning_the_camera_moves_the_image_the_same_at_every_depth():
    T = transform(torch.tensor([[0.0, 0.05, 0.0]]), torch.zeros(1, 3))
    near, far = (warp(_wallpaper(), torch.full((1, 1, HEIGHT, WIDTH), z_m), K, T) for z_m in (0.5, 8.0))
    torch.testing.assert_close(near, far, atol=1e-4, rtol=0)
    assert (near - _wallpaper()).abs().mean() > 0.05


def test_ssim_is_one_for_equal_and_negative_for_inverted_images():
    image = _wallpaper()
    torch.testing.assert_close(ssim(image, image), torch.ones_like(image), atol=1e-4, rtol=0)
    assert ssim(image, 1.0 - image).mean() < 0.0


def test_an_occluded_pixel_is_judged_by_the_source_that_sees_it():
    target = _wallpaper()
    left, right = target.clone(), target.clone()
    left[..., :30], right[..., 34:] = 0.0, 1.0
    assert least_error(target, [left, right]).max() < 1e-6
    assert least_error(target, [left]).max() > 0.1


def test_what_stands_still_is_left_out_and_what_moves_is_kept():
    target, source = _wallpaper(), _wallpaper(4.0)
    source[..., :24, :] = target[..., :24, :]
    depth_m = torch.full((1, 1, HEIGHT, WIDTH), 2.0)
    error = least_error(target, [warp(source, depth_m, K, _sideways(4.0 * 2.0 / FOCAL_PX))])
    kept = moving(target, [source], error)
    assert kept[..., :22, 8:-8].float().mean() < 0.02
    assert kept[..., 26:, 8:-8].float().mean() > 0.98
    assert selfsupervised_loss(_pyramid(depth_m), target, [target], K, [STILL]) < 1e-6


def test_the_loss_is_lowest_at_the_true_depth():
    target, sources = _wallpaper(), [_wallpaper(4.0), _wallpaper(-4.0)]
    poses = [_sideways(side * 4.0 * 2.0 / FOCAL_PX) for side in (1, -1)]
    depths_m = (1.6, 1.8, 2.0, 2.2, 2.5)
    losses = [
        selfsupervised_loss(_pyramid(torch.full((1, 1, HEIGHT, WIDTH), z_m)), target, sources, K, poses)
        for z_m in depths_m
    ]
    assert depths_m[int(np.argmin(losses))] == 2.0


def test_gradients_reach_the_depth_of_every_scale_and_the_pose_network():
    torch.manual_seed(0)
    target, source = _wallpaper(), _wallpaper(1.0)
    depths_m = [d.requires_grad_() for d in _pyramid(torch.full((1, 1, HEIGHT, WIDTH), 2.0))]
    network = PoseNet()
    pose = network(target, source)
    torch.testing.assert_close(pose, STILL, atol=0.02, rtol=0)
    selfsupervised_loss(depths_m, target, [source], K, [pose]).backward()
    for tensor in (*depths_m, network.layers[0].weight, network.layers[-1].weight):
        assert torch.isfinite(tensor.grad).all()
        assert tensor.grad.abs().max() > 0


def test_the_pose_network_learns_how_far_the_image_moved_by_the_loss_alone():
    torch.manual_seed(0)
    target, source = _wallpaper(), _wallpaper(2.0)
    network, depth_m = PoseNet(), torch.full((1, 1, HEIGHT, WIDTH), 2.0)
    optimizer = torch.optim.Adam(network.parameters(), lr=1e-3)
    for _ in range(60):
        loss = least_error(target, [warp(source, depth_m, K, network(target, source))])[..., 4:-4].mean()
        optimizer.zero_grad()
        loss.backward()
        optimizer.step()
    T_source_target = network(target, source)[0].detach()
    x_m, _, z_m = T_source_target[:3, :3] @ torch.tensor([0.0, 0.0, 2.0]) + T_source_target[:3, 3]
    assert loss < 0.01
    assert (FOCAL_PX * x_m / z_m).item() == pytest.approx(2.0, abs=0.2)
