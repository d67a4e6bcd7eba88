"""The web server: one session per browser, loopback by default, and no files left after it stops."""

from __future__ import annotations

import contextlib
import io
import logging
import socket
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import Future
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import viser

from app.compute.ahead import WorkAhead, compute_ahead
from app.compute.jobs import start_pool
from app.compute.pool import ComputePool
from app.compute.prepared import take_prepared
from app.compute.shared import SharedViews
from app.compute.state import Spec
from app.compute.store import Store
from app.drawing.coarse import coarse_glb, is_mesh
from app.drawing.colors import BRAND
from app.drawing.packing import pack
from app.landing import app_page
from app.lesson.languages import preferred
from app.lesson.reading import languages
from app.lessons import OwnLesson, by_kind
from app.screens.calibrate.panel import CalibratePanel
from app.screens.depth.panel import DepthPanel
from app.screens.export.panel import ExportPanel
from app.screens.fuse.panel import FusePanel
from app.screens.network.panel import NetworkPanel
from app.screens.scene.panel import ScenePanel
from app.screens.surface.likely import is_likely, likely
from app.screens.surface.panel import SurfacePanel
from app.session.lecture import Lecture
from app.session.session import Session
from app.web import viser_private as private
from app.web.contents import Contents, Packing, offer_contents
from app.web.crowd import MOST_OF_ONE_ADDRESS, MOST_SESSIONS, Crowd, Visitor
from app.web.door import Door
from app.web.entrance import Entrance, Token, is_loopback, is_unspecified
from app.web.gate import Gate
from app.web.headers import strict_headers
from app.web.names import allowed_names
from app.web.origin import only_own_page, well_formed
from app.web.own_folder import OwnFolder, own_folder
from app.web.page import Page
from app.web.silent import limit_silent
from app.web.uploads import Uploads
from app.window.teaching import Teaching
from app.window.ui import Target
from packetmesh.errors import InputError
from packetmesh.files import file_trouble
from packetmesh.memory import give_back_memory, share_arenas
from pipeline.config import PRESETS, PipelineConfig
from pipeline.sources import Demo, Recorded, RigFolder, demo_of

PANEL_WIDTH_PX = 440
PROBES = {socket.AF_INET: ("192.0.2.1", "127.0.0.1"), socket.AF_INET6: ("2001:db8::1", "::1")}
"""An address of another network, which no machine has, and this machine's loopback address, by family."""
FULL = (
    f"This server takes at most {MOST_SESSIONS} browsers, {MOST_OF_ONE_ADDRESS} from one address, each "
    "with its own reconstruction, and all places are taken. You get in automatically as soon as one is "
    "free. With `packetmesh serve --lecture` all browsers share one reconstruction."
)
PANELS = (ScenePanel, CalibratePanel, DepthPanel, FusePanel, SurfacePanel, NetworkPanel, ExportPanel)
"""Panels of the app's screens, in their order."""


@dataclass(slots=True)
class AppServer:
    """A running app."""

    viser_server: viser.ViserServer
    pool: ComputePool
    folder: OwnFolder
    contents: Contents
    sessions: dict[int, Session] = field(default_factory=dict)
    """Sessions by the numbers of their browsers; a lecture has one session, -1."""
    entrance: Entrance = field(default_factory=Entrance)
    crowd: Crowd = field(default_factory=Crowd)
    ahead: WorkAhead | None = None
    """Computes likely results while no session requests any; None if that is off."""

    @property
    def url(self) -> str:
        """Address for browsers on this machine."""
        return self._at(lambda family: PROBES[family][1])

    @property
    def link(self) -> str:
        """Link for browsers on this machine, with the token if one is needed."""
        return self.url + _token_path(self.entrance.visitor)

    @property
    def class_link(self) -> str:
        """Link for browsers on other machines, if the server listens to them."""
        return self._at(own_address) + _token_path(self.entrance.visitor)

    @property
    def teacher_url(self) -> str:
        """Link of a lecture's teacher."""
        return self.url + _token_path(self.entrance.teacher)

    @property
    def owners(self) -> list[object]:
        """Owners of the pool's jobs: the sessions, and this server for the jobs before the first session."""
        return [self, *(owner for session in list(self.sessions.values()) for owner in session.owners)]

    def _at(self, of_all: Callable[[socket.AddressFamily], str]) -> str:
        """Return the server's URL; ``of_all`` gives the host if it listens on all addresses of a family."""
        host, port = self.viser_server.get_host(), self.viser_server.get_port()
        name = of_all(_family(host)) if is_unspecified(host) else host
        return f"http://{f'[{name}]' if ':' in name else name}:{port}"

    def stop(self) -> None:
        """Stop all sessions and processes and delete the server's folder."""
        if self.ahead is not None:
            self.ahead.close()
        self.crowd.close()
        for session in list(self.sessions.values()):
            session.close()
        with contextlib.redirect_stdout(io.StringIO()):
            self.viser_server.stop()
        self.contents.close()
        self.pool.close()
        self.folder.delete()


def build_server(
    scene: str = "living-room",
    config: PipelineConfig | None = None,
    host: str = "127.0.0.1",
    port: int = 8080,
    lecture: bool = False,
    with_token: bool = True,
    pool: ComputePool | None = None,
    allow_hosts: Iterable[str] = (),
    lessons: Sequence[OwnLesson] = (),
    ahead: bool = False,
) -> AppServer:
    """Start a server and return at once.

    Args:
        scene: name of a demo scene, or a rig folder.
        config: settings to start with; None takes the preset ``packetmesh``.
        host: address to listen on.
        port: port to listen on; 0 lets the system choose one.
        lecture: share one session among all browsers, steered by those that open ``teacher_url``.
        with_token: admit only browsers that open ``class_link``, if other machines can reach the host.
        pool: a pool that is already started; None starts one. It stops with the server.
        allow_hosts: further host names of this server, such as that of a proxy in front of it.
        lessons: a teacher's own lessons.
        ahead: take the results that were computed at installation, and while no job runs compute the surfaces
            of the shown demo scene at all radii.

    Raises:
        InputError: the port is taken, the address is not this machine's, a name is no host name, or the
            installed viser is unknown.
        OSError: the server's folder cannot be made.
    """
    allowed = allowed_names(allow_hosts)
    _check_address(host, port)
    logging.getLogger("websockets").setLevel(logging.CRITICAL)  # a port scan needs no stack trace
    share_arenas()
    page = app_page(lecture, [(one.lesson, one.place) for one in lessons])
    spec = start_spec(scene, config or PipelineConfig())
    folder = own_folder()
    pool = start_pool() if pool is None else pool
    teacher = Token("teacher") if lecture else None
    visitor = Token("token") if with_token and not is_loopback(host) else None
    entrance = Entrance(visitor, teacher)
    door = Door()
    contents = Contents(Packing(pack, is_mesh, coarse_glb))
    server = _listening(host, port, door, entrance, page, allowed, contents)
    gate = Gate(server)
    limit_silent(server)
    offer_contents(server, contents)
    app = AppServer(server, pool, folder, contents, entrance=entrance)
    if port and server.get_port() != port:
        app.stop()
        raise InputError(_taken_sentence(port))
    private.queue_from_any_thread(server)
    private.remember_hints()
    _set_up(server)
    store, uploads = Store(str(folder.path)), Uploads(folder.path)
    shared = SharedViews(store)
    if ahead:
        take_prepared(folder.path)
        app.ahead = _working_ahead(pool, store, shared)
    compute_ahead(pool, store, shared, spec, app)

    known = languages(one.lesson for one in lessons)

    def begin(target: Target, number: int, lecture: Lecture | None = None) -> Session:
        language = preferred(private.languages(server, number), known)
        teaching = Teaching(by_kind(lessons), known, language)
        app.sessions[number] = Session(target, pool, store, uploads, shared, spec, PANELS, lecture, teaching)
        return app.sessions[number]

    if teacher is not None:
        together = Lecture(server, gate, teacher, app.class_link)
        session = begin(server, -1, together)
        together.begin(
            session.post, lambda: session.frame_view(anew=True), session.places.add, session.palettes.add
        )
    else:
        _let_in(app, gate, begin)
    door.is_open = True
    return app


def _working_ahead(pool: ComputePool, store: Store, shared: SharedViews) -> WorkAhead:
    """Return the work ahead. Each time that a demo scene's surface is known, it plans that scene's jobs."""
    work = WorkAhead(pool, store)

    def plan(spec: Spec, view: Any) -> None:
        if is_likely(spec):
            work.plan(spec.key("surface"), lambda: likely(store, spec, view))

    shared.on_surface = plan
    return work


def _listening(
    host: str,
    port: int,
    door: Door,
    entrance: Entrance,
    page: Page,
    allowed: frozenset[str],
    contents: Contents,
) -> viser.ViserServer:
    """Return a server whose requests pass these checks in this order."""
    with contextlib.ExitStack() as outermost_first:
        for answers in (
            well_formed(),
            strict_headers(page.script_hashes, allowed),
            only_own_page(allowed),
            entrance.guarded(),
            door.guarded(),
            contents.served(),
            page.served(),
        ):
            outermost_first.enter_context(answers)
        outermost_first.enter_context(contextlib.redirect_stdout(io.StringIO()))
        return viser.ViserServer(host=host, port=port, label="PacketMesh", verbose=False)


def _let_in(app: AppServer, gate: Gate, begin: Callable[[Target, int], Session]) -> None:
    """Give every browser its own session while it is connected and there is room."""
    server = app.viser_server
    notes = dict[int, Any]()
    """Notifications of the waiting browsers, by their numbers."""

    def leave(client: viser.ClientHandle) -> None:
        app.crowd.leave(client.client_id)
        notes.pop(client.client_id, None)
        session = app.sessions.pop(client.client_id, None)
        if session is not None:
            session.close()
            give_back_memory()

    def start(client: viser.ClientHandle) -> Future[None] | None:
        note = notes.pop(client.client_id, None)
        if note is not None:
            note.remove()
        try:
            built = begin(client, client.client_id).built
        except OSError as error:
            client.add_notification("The app cannot start for you", file_trouble(error), color="red")
            return None
        if client.client_id not in server.get_clients():  # it left before its session was built
            leave(client)
        return built

    def wait(client: viser.ClientHandle) -> None:
        title = "You are waiting for a place"
        notes[client.client_id] = client.add_notification(title, FULL, auto_close_seconds=None)

    async def come(client: viser.ClientHandle) -> None:  # quick enough for the connections' thread
        number = client.client_id
        app.crowd.come(
            Visitor(
                number,
                private.address_of(server, number),
                begin=lambda: start(client),
                wait=lambda: wait(client),
                turn_away=lambda: private.close(
                    server, number, private.TRY_AGAIN, "no room, or no page is shown"
                ),
                shows_page=lambda: gate.shows_page(number),
            )
        )

    def notify_too_much(number: int, sentence: str) -> None:
        session = app.sessions.get(number)
        if session is not None:
            session.post(session.notify, "That did not work", sentence)

    gate.on_too_much = notify_too_much
    server.on_client_connect(come)
    server.on_client_disconnect(leave)


def _token_path(token: Token | None) -> str:
    """Return the part of an address that admits a browser."""
    return "" if token is None else f"/{token.query}"


def start_spec(scene: str, config: PipelineConfig) -> Spec:
    """Return the start spec: a demo scene by name, a rig folder or a recording, with these settings."""
    preset = next((name for name, known in PRESETS.items() if known == config), "packetmesh")
    return Spec(_source(scene), preset, config)


def _source(scene: str) -> Demo | RigFolder | Recorded:
    place = Path(scene)
    if not place.exists():
        return demo_of(scene)
    from pipeline.importing import is_recording
    from pipeline.io.rigs import is_rig

    if is_recording(place) and not is_rig(place):
        return Recorded(str(place.resolve()))
    return RigFolder(str(place.resolve())) if place.is_dir() else Demo(scene)


def own_address(family: socket.AddressFamily) -> str:
    """Return the address at which the network's other machines reach this one; loopback if it has none."""
    elsewhere, loopback = PROBES[family]
    try:
        with socket.socket(family, socket.SOCK_DGRAM) as probe:
            probe.connect((elsewhere, 9))  # sends nothing, but finds the route
            return str(probe.getsockname()[0])
    except OSError:
        return loopback


def _family(host: str) -> socket.AddressFamily:
    return socket.AF_INET6 if ":" in host else socket.AF_INET


def _check_address(host: str, port: int) -> None:
    with socket.socket(_family(host)) as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind((host, port))
        except PermissionError:
            raise InputError(f"Port {port} needs administrator rights; try --port 8080.") from None
        except OverflowError:
            raise InputError(f"There is no port {port}; try one from 1024 to 65535.") from None
        except socket.gaierror:
            raise InputError(f"'{host}' is not an address of this machine; try --host 127.0.0.1.") from None
        except OSError as error:
            if error.errno == 98 or "in use" in str(error):
                raise InputError(_taken_sentence(port)) from None
            raise InputError(f"Cannot listen on {host} ({error.strerror}); try --host 127.0.0.1.") from None


def _taken_sentence(port: int) -> str:
    return f"Port {port} is taken by another program; stop it or try --port {port + 1}."


def _set_up(server: viser.ViserServer) -> None:
    """Set up the control panel, up direction and lights; disable sharing through an outside server."""
    server.gui.configure_theme(
        control_width="large", show_logo=False, show_share_button=False, brand_color=BRAND
    )
    server.gui.main_panel.dock_right()
    server.gui.main_panel.set_width(PANEL_WIDTH_PX)
    server.scene.set_up_direction("+z")
    server.scene.configure_default_lights(cast_shadow=False)  # shadows are costly to render in software
    setattr(server, "request_share_url", lambda *_, **__: None)  # noqa: B010
