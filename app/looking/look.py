"""Display settings of a reconstruction (cut, light, point size, scale bar), and their text in the address.

``plane_2500_1800_900_0_1000_0~wire~ruler``: the settings that differ from the default, joined by ``~``.
Lengths are in millimetres, the components of normals in thousandths, angles in degrees.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np

from app.compute.cuts import Box, Cut, Plane, Top
from packetmesh.errors import InputError

MOST_POINT_MM = 40
EXAMPLE = "plane_2500_1800_900_0_1000_0~ruler"


@dataclass(frozen=True, slots=True)
class Look:
    """Display settings of a reconstruction; the default changes nothing."""

    cut: Cut = None
    wire: bool = False
    """Whether surfaces are drawn as the edges of their triangles."""
    point_mm: int = 0
    """Size of all points; 0 keeps the size that each cloud has."""
    light_deg: tuple[int, int] | None = None
    """Direction to the light: azimuth from +x towards +y, and elevation; None keeps the default light."""
    ruler: bool = False
    """Whether scale bar and axes are drawn."""


def text_of(look: Look) -> str:
    """Return the look as text; empty for the default."""
    parts = [_cut_text(look.cut)] if look.cut is not None else []
    parts += ["wire"] if look.wire else []
    parts += [f"points_{look.point_mm}"] if look.point_mm else []
    parts += [f"light_{look.light_deg[0]}_{look.light_deg[1]}"] if look.light_deg is not None else []
    parts += ["ruler"] if look.ruler else []
    return "~".join(parts)


def _cut_text(cut: Top | Plane | Box) -> str:
    if isinstance(cut, Top):
        return f"top_{_thousandths(cut.height_m)}"
    if isinstance(cut, Plane):
        return f"plane_{_thousandths(*cut.point_m)}_{_thousandths(*cut.normal)}"
    kind = "out" if cut.inside else "box"
    return f"{kind}_{_thousandths(*cut.centre_m)}_{_thousandths(*cut.size_m)}_{round(cut.turn_deg)}"


def _thousandths(*values: float) -> str:
    return "_".join(str(round(1000.0 * value)) for value in values)


def look_of(text: str) -> Look:
    """Return the look of an address.

    Raises:
        InputError: the text is no look.
    """
    cut: Cut = None
    named: dict[str, list[int]] = {}
    for part in filter(None, text.split("~")):
        kind, *numbers = part.split("_")
        if kind in named or not all(re.fullmatch(r"-?\d{1,7}", number) for number in numbers):
            raise _wrong(text)
        named[kind] = [int(number) for number in numbers]
        if kind in _LENGTHS and len(numbers) == _LENGTHS[kind] and cut is None:
            cut = _cut_of(kind, named[kind], text)
        elif kind not in _COUNTS or len(numbers) != _COUNTS[kind]:
            raise _wrong(text)
    light, (size_mm, *_) = named.get("light"), named.get("points", [0])
    if not 0 <= size_mm <= MOST_POINT_MM or (light and not _is_direction(*light)):
        raise _wrong(text)
    light_deg = None if light is None else (light[0], light[1])
    return Look(cut, "wire" in named, size_mm, light_deg, "ruler" in named)


_LENGTHS = {"top": 1, "plane": 6, "box": 7, "out": 7}
"""Number of values of each kind of cut."""
_COUNTS = {"wire": 0, "points": 1, "light": 2, "ruler": 0}


def _cut_of(kind: str, numbers: list[int], text: str) -> Cut:
    values = [0.001 * number for number in numbers]
    if kind == "top":
        return Top(values[0])
    if kind == "plane":
        normal = np.array(values[3:])
        length = float(np.linalg.norm(normal))
        if length < 0.5:
            raise _wrong(text)
        x, y, z = (normal / length).tolist()
        return Plane((values[0], values[1], values[2]), (x, y, z))
    if min(values[3:6]) <= 0.0 or not -90 <= numbers[6] <= 90:
        raise _wrong(text)
    centre_m, size_m = (values[0], values[1], values[2]), (values[3], values[4], values[5])
    return Box(centre_m, size_m, float(numbers[6]), kind == "out")


def _is_direction(azimuth_deg: int, height_deg: int) -> bool:
    return -180 <= azimuth_deg <= 180 and -90 <= height_deg <= 90


def _wrong(text: str) -> InputError:
    return InputError(
        f"The address has look={text[:40]}, which is not a valid display setting; try one such as {EXAMPLE}"
    )
