"""What tuning chose; written by ``python -m lab.claims.registration``."""

from __future__ import annotations

TUNED: dict[str, tuple[str, float, dict[float, float]]] = {
    "icp-gated": ("gate_scale", 0.25, {0.25: 2.974, 0.5: 3.5398, 1: 4.6098, 2: 7.2767}),
    "trimmed-icp": ("trim", 0.7, {0.6: 3.212, 0.7: 3.1086, 0.8: 3.2403, 0.9: 4.4435}),
    "picp": ("level", 1, {1: 3.3014, 2: 3.3337, 3: 3.338, 4: 3.3519}),
    "ricp": ("gate_scale", 1, {0.5: 3.5651, 1: 3.4915, 2: 3.5437, 1000: 3.6155}),
    "mricp": ("most_steps", 50, {5: 7.4572, 10: 7.412, 25: 7.3989, 50: 7.3976}),
    "ficp": ("exponent", 2, {0.6: 7.1703, 0.95: 3.8773, 1.3: 2.96, 2: 2.8674}),
    "hicp": ("hue_weight_m", 0.3, {0.05: 4.4064, 0.1: 4.3722, 0.3: 4.1687, 0.5: 4.5311}),
    "ceicp-literal": ("gate_scale", 0.25, {0.25: 2.9794, 0.5: 3.3702, 1: 4.6599, 2: 7.0237}),
    "ceicp-n": ("gate_scale", 0.5, {0.25: 2.7523, 0.5: 2.6862, 1: 3.145, 2: 3.7735}),
    "ceicp-a": ("gate_scale", 1, {0.25: 3.6469, 0.5: 3.4635, 1: 2.8277, 2: 2.9821}),
    "ceicp-r": ("sigma_min_m", 0.01, {0.01: 2.9475, 0.02: 2.9475, 0.03: 2.9475, 0.04: 2.9475}),
    "ceicp-ml": ("sigma_min_m", 0.01, {0.01: 2.9911, 0.02: 2.9911, 0.03: 3.0665, 0.04: 3.348}),
    "kernel-correlation": ("gate_scale", 1, {0.25: 3.5064, 0.5: 3.2275, 1: 2.7214, 2: 2.8123}),
    "fast-robust-icp": ("nu_min_m", 0.02, {0.01: 2.8671, 0.02: 2.7785, 0.03: 3.0793, 0.04: 3.1435}),
    "icp-gated plane": ("gate_scale", 0.25, {0.25: 2.0701, 0.5: 2.2307, 1: 3.3866, 2: 4.8711}),
    "picp plane": ("level", 4, {1: 1.6705, 2: 1.6684, 3: 1.6666, 4: 1.6657}),
    "ficp plane": ("exponent", 2, {0.6: 3.2844, 0.95: 2.0319, 1.3: 2.095, 2: 2.0126}),
    "ceicp-n plane": ("gate_scale", 0.5, {0.25: 1.9793, 0.5: 1.9362, 1: 2.0908, 2: 2.4475}),
    "ceicp-a plane": ("gate_scale", 0.5, {0.25: 2.3536, 0.5: 2.2157, 1: 2.3028, 2: 2.2996}),
    "ceicp-r plane": ("sigma_min_m", 0.01, {0.01: 2.0224, 0.02: 2.0224, 0.03: 2.0224, 0.04: 2.0224}),
    "fast-robust-icp plane": ("nu_min_m", 0.04, {0.01: 2.7787, 0.02: 2.2351, 0.03: 2.1113, 0.04: 2.0793}),
    "open3d-plane": ("gate_scale", 0.25, {0.25: 2.0983, 0.5: 2.2314, 1: 3.3843, 2: 4.8713}),
    "open3d-gicp": ("gate_scale", 0.25, {0.25: 2.0946, 0.5: 2.1686, 1: 2.2148, 2: 2.4661}),
    "small-gicp": ("gate_scale", 0.25, {0.25: 2.0942, 0.5: 2.1988, 1: 2.2579, 2: 2.5246}),
    "small-gicp-staged": ("gate_scale", 0.5, {0.25: 2.551, 0.5: 1.9024, 1: 2.1094, 2: 2.2448}),
    "small-vgicp-staged": ("gate_scale", 0.5, {0.25: 3.2364, 0.5: 2.9008, 1: 3.0608, 2: 3.235}),
}
"""By entrant: the parameter, the chosen value, and the score of every value that was tried: the geometric
mean of the point error over the tuning cases, centimetres."""
