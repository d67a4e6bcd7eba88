"""``packetmesh lesson``: checks of a teacher's own lessons."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import tyro

from app.cli.text import aligned, print_json, say, wrong_use
from packetmesh.errors import PacketMeshError


def lesson(
    action: Annotated[Literal["check"], tyro.conf.Positional],
    files: Annotated[tuple[Path, ...], tyro.conf.Positional] = (),
    json: bool = False,
) -> None:
    """Check lessons of your own, with their translations, and print each fault with its file and line.

    `packetmesh serve --lesson FILE` offers such a lesson; docs/using.md describes the format.

    Args:
        action: What to do with the lessons.
        files: Lessons (my-lesson.md) and folders of lessons.
        json: Print lessons and faults as JSON.
    """
    if not files:
        wrong_use("lesson check needs a file such as my-lesson.md, or a folder of lessons")
    from app.lessons import check_lessons

    lessons, faults = check_lessons(files)
    if json:
        print_json(
            {
                "lessons": [
                    {
                        "file": str(one.path),
                        "title": one.lesson.title,
                        "screen": one.kind,
                        "scene": one.lesson.scene,
                        "stops": len(one.lesson.stops),
                        "languages": [one.lesson.language, *one.lesson.translations],
                    }
                    for one in lessons
                ],
                "faults": [
                    {"file": str(fault.path), "line": fault.line, "sentence": fault.sentence}
                    for fault in faults
                ],
            }
        )
    else:
        for fault in faults:
            say(str(fault))
        if lessons:
            rows = [
                (
                    str(one.path),
                    f"{one.lesson.title}",
                    f"{len(one.lesson.stops)} stops on {one.kind}",
                    ", ".join([one.lesson.language, *one.lesson.translations]),
                )
                for one in lessons
            ]
            print(aligned(rows))
    if faults:
        count = "1 fault was" if len(faults) == 1 else f"{len(faults)} faults were"
        raise PacketMeshError(f"{count} found")
