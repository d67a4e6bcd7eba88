"""``pm.show``: a result as a 3-D view on a page of its own, which a notebook shows."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import rich
import viser
from markupsafe import Markup

from app.notebook.scenes import Play, add_registration, add_result
from packetmesh.errors import InputError
from pipeline.notebook.views import View
from pipeline.reconstruct import Reconstruction
from pipeline.types import FloatArray, PointCloud, RegistrationResult, Rig, Surface

HEIGHT_PX = 420
_FRAME = Markup(
    '<iframe srcdoc="{}" title="{}" style="width: 100%; height: {}px; border: 1px solid #bbb; '
    'box-sizing: border-box; display: block"></iframe>'
)


@dataclass(frozen=True, slots=True)
class Shown:
    """A 3-D view, which Jupyter and marimo show if it is the last value of a cell."""

    title: str
    page: str = field(repr=False)
    """A whole HTML page that needs neither a server nor a network; written to a file, a browser opens it."""

    def _repr_html_(self) -> str:
        """Return a frame that contains the page."""
        return str(_FRAME.format(self.page, self.title, HEIGHT_PX))


def show(
    result: Reconstruction | Surface | PointCloud | Rig | RegistrationResult,
    source: PointCloud | None = None,
    target: PointCloud | None = None,
    T_init: FloatArray | None = None,
) -> Shown:
    """Draw a result in 3-D for a notebook: the mouse turns it, and it stays in the saved notebook.

    Of a registration it plays how the source cloud (orange) moves onto the target cloud (blue), step by step.

    Args:
        result: a reconstruction, surface, cloud, rig or registration.
        source: the cloud that was registered; only with a registration.
        target: the cloud to which it was registered.
        T_init: (4, 4) start pose T_target_source that was given to ``register``; None is the identity.

    Raises:
        InputError: the result is of another kind or empty, or a registration comes without its clouds.

    >>> import numpy as np, packetmesh as pm
    >>> cloud = pm.PointCloud(np.random.default_rng(0).uniform(0.0, 1.0, (500, 3)))
    >>> view = pm.show(cloud)
    >>> view.title, view.page[:15]
    ('Cloud of 500 points', '<!doctype html>')
    """
    if not isinstance(result, RegistrationResult):
        if source is not None or target is not None or T_init is not None:
            raise InputError("Clouds and a start pose belong to a registration; try pm.show(result) alone")
        return _page(_title(result), lambda scene: (add_result(result, scene), None))
    if source is None or target is None:
        raise InputError(
            "A registration is shown with its two clouds; try pm.show(result, source, target, T_init)"
        )
    both = source, target
    return _page(_title(result), lambda scene: add_registration(scene, result, *both, T_init))


def _title(result: object) -> str:
    if isinstance(result, PointCloud):
        return f"Cloud of {len(result):,} points"
    if isinstance(result, Surface):
        return f"Surface of {len(result.triangles):,} triangles"
    if isinstance(result, RegistrationResult):
        return f"Registration in {len(result.steps):,} steps"
    if isinstance(result, Reconstruction):
        return f"Reconstruction of {result.rig.name}"
    return f"Rig {result.name}" if isinstance(result, Rig) else "Result"


def _page(title: str, draw: Callable[[viser.SceneApi], tuple[View, Play | None]]) -> Shown:
    """Return the page of a scene that ``draw`` fills."""
    with _server() as server:
        view, play = draw(server.scene)
        server.scene.set_up_direction(view.up)
        server.initial_camera.fov = view.fov_rad
        server.initial_camera.up = view.up
        server.initial_camera.position = view.position_m
        server.initial_camera.look_at = view.look_at_m
        recording = server.get_scene_serializer()
        if play is not None:
            play(recording)
        return Shown(title, recording.as_html())


@contextlib.contextmanager
def _server() -> Iterator[viser.ViserServer]:
    """Run a viser server, without which nothing can be drawn, for the body; it prints nothing."""
    console = rich.get_console()
    was_quiet, console.quiet = console.quiet, True
    try:
        server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
        try:
            yield server
        finally:
            server.stop()
    finally:
        console.quiet = was_quiet
