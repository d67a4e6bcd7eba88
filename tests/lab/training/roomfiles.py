"""Shards as the renderer writes them, small and made in a moment, and what an exported network should say."""

from pathlib import Path

import numpy as np


def write_rooms(data: Path) -> Path:
    """One shard a split, 8 images to train and 2 to validate, whose depth grows from top to bottom."""
    rng = np.random.default_rng(0)
    data.mkdir()
    for split, count in (("train", 8), ("validation", 2)):
        depth_m = np.repeat(np.linspace(1.0, 4.0, 240, dtype=np.float16)[:, None], 320, axis=1)
        np.save(data / f"{split}_0000_depth.npy", np.stack([depth_m] * count))
        rgb = np.stack([depth_m * 60] * 3, axis=-1) + rng.normal(0, 5, (count, 240, 320, 3))
        np.save(data / f"{split}_0000_rgb.npy", rgb.clip(0, 255).astype(np.uint8))
    return data


def mirrored_m(model, rgb: np.ndarray) -> np.ndarray:
    """(240, 320) geometric mean of a checkpoint's depth of an image and of its mirror image, as exported."""
    import torch

    from lab.training.train import Stage, collate

    image = collate([(rgb, np.ones((240, 320), np.float32))], Stage(1, (256, 320), 1))[0]
    with torch.no_grad():
        both_m = model(image)[0] * model(image.flip(3))[0].flip(3)
    return torch.sqrt(both_m)[0, 0, 8:-8].numpy()
