"""Recognition of several cameras among the images of one folder, by file names and EXIF data."""

from __future__ import annotations

import re
from collections.abc import Sequence
from fnmatch import fnmatchcase
from pathlib import Path

from PIL import ExifTags, Image

from packetmesh.errors import InputError

LEAST_IMAGES = 2
"""Least number of images with the same camera in their names."""
_CAMERAS = tuple(
    re.compile(sign)
    for sign in (
        r"(?i)(left|right)",
        r"(?i)(?<![a-z])(l|r)(?![a-z])",
        r"(?<=[a-z])(L|R)(?![A-Za-z])",
        r"(?i)(?:cam|camera|sensor|device|kinect|realsense|imager)[ _.-]?(\d+|[a-d](?![a-z]))",
        r"(?i)(?<![a-z])(c\d|rgb|colou?r|infra(?:red)?\d?|ir\d?|nir|thermal|mono)(?![a-z\d])",
    )
)
"""Patterns of a camera in a file's name; images with equal matches are of one camera."""
LEAST_MOMENTS = 3
"""Least number of moments that cameras without a recognised name have in common."""
_PARTS = re.compile(r"[^\W\d_]+|\d+|[\W_]+")
"""Words, numbers and separators in a file's name."""
_BODY = (ExifTags.Base.Make, ExifTags.Base.Model, ExifTags.Base.BodySerialNumber)
_FOCAL = ExifTags.Base.FocalLength


def camera_series(files: Sequence[Path]) -> dict[str, dict[Path, str]]:
    """Return images by the camera in their names, each with its name without the camera; empty if the names
    show fewer than two cameras.

    Names such as left-0000.jpg and right-0000.jpg show two cameras, and so do cam0_01.png and cam1_01.png.
    """
    for sign in _CAMERAS:
        found: dict[str, dict[Path, str]] = {}
        for path in files:
            match = sign.search(path.stem)
            if match is not None:
                rest = path.stem[: match.start()] + path.stem[match.end() :]
                found.setdefault(match[0].lower(), {})[path] = rest
        found = {name: paths for name, paths in found.items() if len(paths) >= LEAST_IMAGES}
        if len(found) > 1:
            return dict(sorted(found.items()))
    return {}


def same_moments(files: Sequence[Path]) -> dict[str, dict[Path, str]]:
    """Return images by that word or number in their names that has fewest values with common moments, such as
    front_1.png and back_1.png, front_2.png and back_2.png; empty if there is none.

    The values share at least three moments, and at least half of the moments of the longest series.

    These may be several cameras, or several series of one.
    """
    names = {path: _PARTS.findall(path.stem) for path in files}
    lengths = {len(parts) for parts in names.values()}
    best: dict[str, dict[Path, str]] = {}
    for position in range(lengths.pop() if len(lengths) == 1 else 0):
        found: dict[str, dict[Path, str]] = {}
        for path, parts in names.items():
            rest = "".join(parts[:position] + parts[position + 1 :])
            found.setdefault(parts[position].lower(), {})[path] = rest
        moments = [set(rests.values()) for rests in found.values()]
        shared = len(set.intersection(*moments))
        if len(found) < 2 or shared < max(LEAST_MOMENTS, 0.5 * max(map(len, moments))):
            continue
        if not best or len(found) < len(best):
            best = found
    return dict(sorted(best.items()))


def check_one_camera(files: Sequence[Path]) -> None:
    """Check that names and EXIF data do not show several cameras, or several focal lengths of one.

    Raises:
        InputError: they do.
    """
    series = camera_series(files)
    if series:
        counts = " and ".join(f"{len(paths)} of '{name}'" for name, paths in series.items())
        alone = _pattern(list(next(iter(series.values()))), files)
        raise InputError(
            f"The images are of {len(series)} cameras by their names: {counts}. Give each camera's images a "
            f"folder of its own{alone}, or add --rig to calibrate the cameras together; if one camera took "
            "all images, add --one-camera"
        )
    made = {path: made_by(path) for path in files}
    kinds = dict.fromkeys(kind for kind in made.values() if kind)
    if len(kinds) > 1:
        first, second = list(kinds)[:2]
        examples = [next(path.name for path, kind in made.items() if kind == one) for one in (first, second)]
        raise InputError(
            f"The images are of {len(kinds)} cameras or focal lengths by their EXIF data: {examples[0]} of "
            f"'{first}', {examples[1]} of '{second}'. Give each camera's images a folder of its own; if one "
            "camera took all images with one focal length, add --one-camera"
        )


def _pattern(mine: Sequence[Path], files: Sequence[Path]) -> str:
    """Return the advice to give one camera's images by a pattern; empty if no pattern matches only them."""
    names = [path.name for path in mine]
    first = _common(names)
    last = _common([name[len(first) :][::-1] for name in names])[::-1]
    for start in (first.rstrip("0123456789 _.-"), first):
        matched = {path for path in files if fnmatchcase(path.name, f"{start}*{last}")}
        if matched == set(mine):
            return f', or one camera\'s alone by "{start}*{last}"'
    return ""


def _common(words: Sequence[str]) -> str:
    """Return the longest prefix that all words share."""
    shortest = min(words, key=len)
    apart = (k for k in range(len(shortest)) if any(word[k] != shortest[k] for word in words))
    return shortest[: next(apart, len(shortest))]


def made_by(path: Path) -> str:
    """Return camera and focal length from an image's EXIF data; empty if there are none."""
    try:
        with Image.open(path) as image:
            exif = image.getexif()
            detail = exif.get_ifd(ExifTags.IFD.Exif)
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError):
        return ""  # the image's reader says what is wrong with it
    body = [_text(exif.get(key, detail.get(key))) for key in _BODY]
    focal = detail.get(_FOCAL)
    try:
        words = [*body, "" if focal is None else f"{float(focal):g} mm"]
    except (TypeError, ValueError, ZeroDivisionError):
        words = body
    return " ".join(word for word in words if word)


def _text(value: object) -> str:
    return "" if value is None else str(value).strip("\0 ")
