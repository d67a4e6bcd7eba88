"""``packetmesh scenes``: the list of demo scenes."""

from __future__ import annotations

from app.cli.text import print_json


def scenes(json: bool = False) -> None:
    """List the demo scenes that can be loaded.

    Args:
        json: Print them as one JSON object.
    """
    from pipeline.io.demos import DEMOS

    if json:
        print_json({name: scene.description for name, scene in DEMOS.items()})
        return
    for name, scene in DEMOS.items():
        print(f"{name:<16} {scene.description}")
