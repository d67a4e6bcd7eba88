"""A furnished room as points, without any symmetry."""

import numpy as np


def room(seed: int, count: int = 4000) -> np.ndarray:
    """Walls, floor and two unlike boxes, not the same on both sides of any plane."""
    rng = np.random.default_rng(seed)
    a, b = rng.uniform(0.0, 1.0, (2, count))
    zero = np.zeros(count)
    faces = [(4 * a, 3 * b, zero), (zero, 3 * a, 2 * b), (4 * a, zero, 2 * b)]
    faces += [
        (0.5 + a, 1.0 + 0.5 * b, 0.8 + zero),
        (1.5 + zero, 1.0 + 0.5 * a, 0.8 * b),
        (0.5 + a, 1.0 + zero, 0.8 * b),
    ]
    faces += [(3.0 + 0.4 * a, 2.0 + 0.7 * b, 1.5 + zero), (3.0 + zero, 2.0 + 0.7 * a, 1.5 * b)]
    return np.concatenate([np.stack(face, axis=1) for face in faces])
