"""Measures in the 3-D scene: ends, rulers between them, planes, boxes, rims, and labels with the numbers."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import combinations

import numpy as np
import viser

from app.compute.measures import End, Face, Made, Taken
from app.drawing.colors import BRAND, INFERRED, linear
from app.drawing.quantities import short_text
from pipeline.types import ByteArray, FloatArray

INK, PAPER = (24, 28, 32), (255, 255, 255)
"""Alternating colours of a ruler; violet replaces the first if an end was guessed."""
LINE_PX, DOT_PX = 5.0, 13.0
LIFT_M = 0.004
"""Distance of ends, rulers and planes from the surface, which would else hide parts of them."""
OPACITY = 0.3
LETTER_PX, LABEL_PX, GAP_PX = 7.5, 26.0, 12.0
"""Width of a letter, height of a label, and its distance from what it names, pixels."""
MARKS = (1.0, 2.0, 5.0)
FEWEST_MARKS = 6
"""Least number of a ruler's parts, each of which is 1, 2 or 5 times a power of ten long."""
LEVEL = 0.2
"""Sine of the slope up to which a line has its label in the middle, which would cover a steeper line."""
SQUARE = 1e-3
"""Two edges of a box whose cosine is smaller count as perpendicular."""


class MeasureDrawing:
    """The measures of a list, and the points of one that is not complete, below a scene node."""

    def __init__(self, scene: viser.SceneApi, below: str) -> None:
        self._scene, self._below = scene, below
        self._drawn: dict[tuple[int, str], tuple[Made, list[viser.SceneNodeHandle]]] = {}
        self._pending: list[viser.SceneNodeHandle] = []
        self._labels: list[tuple[viser.LabelHandle, FloatArray]] = []
        """Labels and their (3,) places before they are lifted."""
        self._count = 0

    def draw(
        self,
        measures: Sequence[tuple[Taken, str, Made]],
        pending: Sequence[End] = (),
        camera: viser.CameraHandle | None = None,
        note: tuple[str, FloatArray] | None = None,
    ) -> None:
        """Draw these measures with their names, and these points; remove all others.

        Args:
            measures: marks, name and result of each; those without quantities are not drawn.
            pending: points of a measure that is not complete.
            camera: view for which labels are moved apart; None without a browser.
            note: a line over the picture and its (3,) place.
        """
        wanted = {(id(made), name): (taken, made) for taken, name, made in measures if made.quantities}
        for key in self._drawn.keys() - wanted.keys():
            self._remove(self._drawn.pop(key)[1])
        for key, (taken, made) in wanted.items():
            if key not in self._drawn:
                self._drawn[key] = made, self._add(key[1], taken, made)
        self._remove(self._pending)
        self._pending = [self._dot(end) for end in pending]
        if note is not None:
            text, place_m = note
            self._pending.append(self._scene.add_label(self._next(), text, position=place_m))
        if camera is not None and self._labels:
            self._spread(camera)

    def _spread(self, camera: viser.CameraHandle) -> None:
        """Lift labels in the view so that none covers another one."""
        known = self._scene.get_handle_by_name
        labels = self._labels = [one for one in self._labels if known(one[0].name) is one[0]]
        view = (np.asarray(camera.position, float), np.asarray(camera.look_at, float))
        px_per_m = camera.image_height / (2.0 * np.tan(0.5 * camera.fov))
        places_m = np.array([place_m for _, place_m in labels]).reshape(-1, 3)
        lifted_m = spread_m(places_m, [len(handle.text) for handle, _ in labels], view, px_per_m)
        for (handle, _), place_m in zip(labels, lifted_m, strict=True):
            handle.position = place_m

    def _remove(self, handles: Iterable[viser.SceneNodeHandle]) -> None:
        """Remove nodes, except those that were removed with the screen's own drawing."""
        for handle in handles:
            if self._scene.get_handle_by_name(handle.name) is handle:
                handle.remove()

    def _add(self, name: str, taken: Taken, made: Made) -> list[viser.SceneNodeHandle]:
        lines = lines_of(taken, made)
        handles = [self._ruler(line_m, made.guessed) for line_m in lines]
        handles += [self._dot(end) for end in made.ends]
        handles += [self._face(face) for face in made.faces]
        text = f"{name}: {short_text(made.quantities)}" + (" · guessed" if made.guessed else "")
        place_m = label_place_m(taken, lines)
        label = self._scene.add_label(self._next(), text, position=place_m, anchor="bottom-center")
        self._labels.append((label, place_m))
        return [*handles, label]

    def _ruler(self, line_m: FloatArray, guessed: bool) -> viser.SceneNodeHandle:
        points, colors = ruler(line_m, INFERRED if guessed else INK)
        return self._scene.add_line_segments(
            self._next(), points, linear(colors), thickness=LINE_PX, thickness_units="screen"
        )

    def _dot(self, end: End) -> viser.SceneNodeHandle:
        """Draw an end as a dot of ``DOT_PX`` at all distances."""
        point_m = end.point_m + LIFT_M * end.normal
        across_m = 1e-4 * np.roll(end.normal, 1)
        segment = np.stack([point_m - across_m, point_m + across_m])[None].astype(np.float32)
        color = np.array(INFERRED if end.guessed else INK, np.uint8)
        return self._scene.add_line_segments(
            self._next(), segment, color, thickness=DOT_PX, thickness_units="screen"
        )

    def _face(self, face: Face) -> viser.SceneNodeHandle:
        return self._scene.add_mesh_simple(
            self._next(),
            (face.corners_m + LIFT_M * face.normal).astype(np.float32),
            np.array([[0, 1, 2], [0, 2, 3]]),
            color=INFERRED if face.guessed else BRAND,
            opacity=OPACITY,
            side="double",
            flat_shading=True,
            cast_shadow=False,
            receive_shadow=False,
        )

    def _next(self) -> str:
        self._count += 1
        return f"{self._below}/{self._count}"


def lines_of(taken: Taken, made: Made) -> list[FloatArray]:
    """Return the lines of a measure, each (K, 3): its length, both legs of an angle, a rim, a box's edges."""
    ends_m = made.ends_m
    if ends_m is None:
        return []
    if taken.kind == "hole":
        return [np.concatenate([ends_m, ends_m[:1]])]
    if taken.kind == "box":
        return [ends_m[[one, other]] for one, other in box_edges(ends_m)]
    lifted_m = ends_m.astype(float)
    for row, end in enumerate(made.ends):
        lifted_m[row] += LIFT_M * end.normal
    return [lifted_m]


def box_edges(corners_m: FloatArray) -> list[tuple[int, int]]:
    """Return the index pairs of the 12 edges of a box with (8, 3) corners in any order."""
    from_first = corners_m - corners_m[0]
    length_m = np.linalg.norm(from_first, axis=1)
    sides_m = list[FloatArray]()
    for row in np.argsort(length_m)[1:]:  # a diagonal is longer than its edges, not perpendicular to all
        cosines = [float(from_first[row] @ side) / length_m[row] / np.linalg.norm(side) for side in sides_m]
        if all(abs(cosine) < SQUARE for cosine in cosines):
            sides_m.append(from_first[row])
    sides = np.array(sides_m)
    beyond = from_first @ sides.T > 0.5 * np.sum(sides**2, axis=1)  # (8, 3): at the far end of each side
    return [
        (one, other)
        for one, other in combinations(range(len(corners_m)), 2)
        if np.count_nonzero(beyond[one] != beyond[other]) == 1
    ]


def label_place_m(taken: Taken, lines: Iterable[FloatArray]) -> FloatArray:
    """Return the (3,) place of a label: an angle's corner, above a box, at the upper end of a steep line,
    else in the middle.
    """
    points_m = np.concatenate(list(lines))
    if taken.kind == "box":
        top_m: FloatArray = points_m.mean(axis=0)
        top_m[2] = points_m[:, 2].max()
        return top_m
    if len(points_m) == 3:
        return np.array(points_m[1])
    steep = len(points_m) == 2 and np.ptp(points_m[:, 2]) > LEVEL * np.linalg.norm(np.ptp(points_m, axis=0))
    return np.array(points_m[points_m[:, 2].argmax()] if steep else points_m.mean(axis=0))


def spread_m(
    places_m: FloatArray, letters: Sequence[int], view: tuple[FloatArray, FloatArray], px_per_m: float
) -> FloatArray:
    """Return (N, 3) places of labels, moved up in the picture until none covers another one.

    Args:
        places_m: (N, 3) places before.
        letters: number of letters of each label.
        view: (3,) camera position and (3,) look-at point.
        px_per_m: pixels of a metre at a distance of a metre.
    """
    stand_m, forward = view[0], (view[1] - view[0]) / max(float(np.linalg.norm(view[1] - view[0])), 1e-9)
    right = np.cross(forward, (0.0, 0.0, 1.0))
    right /= max(float(np.linalg.norm(right)), 1e-9)
    up = np.cross(right, forward)
    away_m = np.maximum((places_m - stand_m) @ forward, 1e-3)
    x_px, y_px = (px_per_m * ((places_m - stand_m) @ axis) / away_m for axis in (right, up))
    lift_px, done = np.full(len(places_m), GAP_PX), list[int]()
    for row in np.argsort(y_px, kind="stable").tolist():
        covered = [
            other
            for other in done
            if abs(x_px[row] - x_px[other]) < 0.5 * LETTER_PX * (letters[row] + letters[other])
        ]
        for at_px in sorted(y_px[other] + lift_px[other] for other in covered):
            if abs(y_px[row] + lift_px[row] - at_px) < LABEL_PX:
                lift_px[row] = at_px + LABEL_PX - y_px[row]
        done.append(row)
    return places_m + (lift_px * away_m / px_per_m)[:, None] * up


def ruler(line_m: FloatArray, color: tuple[int, int, int]) -> tuple[FloatArray, ByteArray]:
    """Return (S, 2, 3) segments along a (K, 3) line and their colours, which alternate at round lengths."""
    edges_m = np.linalg.norm(np.diff(line_m, axis=0), axis=1)
    at_m = np.concatenate([[0.0], np.cumsum(edges_m)])
    step_m = mark_m(float(at_m[-1]))
    stops_m = np.union1d(at_m, np.arange(0.0, at_m[-1], step_m))
    points_m = np.stack([np.interp(stops_m, at_m, column) for column in line_m.T], axis=1)
    middles_m = 0.5 * (stops_m[1:] + stops_m[:-1])
    dark = (middles_m // step_m).astype(int) % 2 == 0
    shades = np.where(dark[:, None], np.array(color), np.array(PAPER)).astype(np.uint8)
    segments = np.stack([points_m[:-1], points_m[1:]], axis=1).astype(np.float32)
    return segments, np.repeat(shades[:, None], 2, axis=1)


def mark_m(length_m: float) -> float:
    """Return the length of the parts of a ruler of this length, metres."""
    most_m = max(length_m, 1e-6) / FEWEST_MARKS * (1.0 + 1e-9)
    power = 10.0 ** np.floor(np.log10(most_m))
    return float(max(factor * power for factor in MARKS if factor * power <= most_m))
