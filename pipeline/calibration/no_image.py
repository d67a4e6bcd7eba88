"""Remedies for a folder or file that holds no images: sub-folders, videos, other formats."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from shlex import quote

from pipeline.calibration.shots import photographs

VIDEOS = (".mp4", ".avi", ".mov", ".mkv", ".webm", ".m4v", ".mpg", ".mpeg", ".wmv")


def is_video(path: Path) -> bool:
    """Return whether a file's ending is that of a video."""
    return path.suffix.lower() in VIDEOS


def why_no_image(path: Path) -> str:
    """Return the end of the sentence "... names no image": what the path contains instead, and the remedy."""
    if is_video(path) and path.is_file():
        return _of_video(path)
    if not path.is_dir():
        return "; try files, a folder with images, or a pattern in quotes"
    inside = sorted(one for one in path.iterdir() if not one.name.startswith("."))
    folders = [one for one in inside if one.is_dir() and photographs(one)]
    if len(folders) == 1:
        return f", but its folder {folders[0].name} does; give {folders[0]}"
    if folders:
        names = " ".join(quote(str(one)) for one in folders)
        return f", but its folders do; give those of the cameras: {names}"
    video = next(filter(is_video, inside), None)
    if video is not None:
        return _of_video(video)
    kinds = Counter(one.suffix.lower() for one in inside if one.is_file() and one.suffix)
    if kinds:
        kind, count = kinds.most_common(1)[0]
        files = f"a file {kind}" if count == 1 else f"{count} files {kind}"
        return f", but the folder holds {files}; convert images to PNG, JPEG, TIFF, PGM or PPM"
    return "; the folder is empty of images: try another, files, or a pattern in quotes"


def _of_video(path: Path) -> str:
    frames = quote(str(path.parent / "frames_%03d.png"))
    return (
        f", because {path.name} is a video; write sharp frames of it as images, for example with "
        f"'ffmpeg -i {quote(str(path))} -vf fps=1 {frames}', and give those"
    )
