"""The Calibrate screen's panel: views of a board, the cameras estimated from them, their uncertainty."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import replace
from functools import partial
from typing import Any, ClassVar

from app.compute.records import SceneView
from app.compute.state import BoardViews, Spec, Step
from app.lesson.files import Numbers
from app.lesson.on_screen import ScreenLessons
from app.screens.calibrate.answers import Answers
from app.screens.calibrate.depth import DepthFolder
from app.screens.calibrate.draw import BELOW, BoardsDrawing, place_of, stand_before
from app.screens.calibrate.labels import AROUND, DEPTH, NO_RIG, NOTHING, TEXT
from app.screens.calibrate.lens_folder import LensFolder
from app.screens.calibrate.lesson import KIND, SHIPPED, CalibrateLook, left_out, numbers
from app.screens.calibrate.noise import NoiseFolder
from app.screens.calibrate.noise_view import NoiseRequest
from app.screens.calibrate.numbers import ParameterFolder, summary_table
from app.screens.calibrate.photographs import Photographs, picture_of
from app.screens.calibrate.request import calibrate_command, inner, several, views_in, with_boards
from app.screens.calibrate.rig import RigFolder
from app.screens.calibrate.trust import TrustFolder, verdict_html
from app.screens.calibrate.uploads import UploadFolder
from app.screens.calibrate.use import UseRow
from app.screens.calibrate.view import CalibrationView, CameraView, RigView, TrustView
from app.web.markup import Markdown, Markup
from app.window.in_address import STOP, Awaited
from app.window.panel import Panel
from packetmesh.errors import InputError
from pipeline.io.demos import DEMO_SCENES, board_views_of
from pipeline.sources import Calibrated, Demo


class CalibratePanel(Panel):
    """Views of a board, the cameras estimated from them, and the verdict on each."""

    title = "Calibrate"
    step: ClassVar[Step | None] = "calibrate"
    drawn_below = BELOW
    only_when_shown: ClassVar[bool] = True

    def build(self) -> None:
        """Add verdict, camera, bars, views, pictures and drawing; the other numbers are in folders."""
        gui, ui, session = self.gui, self.ui, self.session
        self._source = inner(session.spec.source)
        self._here = self._had_views = self._undrawn = False
        self._view: CalibrationView | None = None
        self._whole: dict[str, CameraView] = {}
        """Every camera before a view of it was dropped."""
        self._answers = Answers(session, self._judged, self._show_view)
        self._framed: tuple[Hashable, ...] = ()
        self._loaded: SceneView | None = None
        """The scene as it was loaded."""
        self._groups = list[Any]()
        """Controls that need photographs."""
        with self._group():
            gui.add_markdown(TEXT)
            shipped = {STOP: SHIPPED}
            self._lessons = ScreenLessons(ui, KIND, shipped, self._take_look, self._lesson_numbers)
        self._status = gui.add_markdown(Markdown(""))
        scenes = {DEMO_SCENES[name].title: partial(self._open_scene, name) for name in with_boards()}
        self._open = ui.buttons("Open", scenes, "Scene with photographs of a board.", visible=False)
        self._verdict = gui.add_html(Markup(""))
        self._use = UseRow(ui, session)
        self._loadedras = gui.add_dropdown(
            "Camera", ["node_00"], hint="Camera whose views are shown.", visible=False
        )
        self._loadedra = Awaited(ui, self._loadedras, self._picked_camera)
        self._photographs = Photographs(
            ui, self._answers, self._pick, self._show_view, self._drop, self._keep_all
        )
        self.in_address |= self._lessons.in_address | {"node": self._loadedra}
        self.in_address |= {"photo": self._photographs, "pictures": self._photographs.area}
        self._around = gui.add_dropdown(
            "In space", list(AROUND), hint="Object that is fixed in the 3-D scene."
        )
        ui.when_changed(self._around, self._draw)
        self._no_rig = gui.add_markdown(NO_RIG, visible=False)
        self._numbers = gui.add_html(Markup(""))
        self._build_folders()
        self._drawing = BoardsDrawing(self.scene, lambda name: ui.post(self._pick, name))
        self._show_camera()

    def _build_folders(self) -> None:
        ui, session = self.ui, self.session
        with self._group():
            self._judge = TrustFolder(ui, self._request_answers)
            self._parameters = ParameterFolder(ui)
            self._depth = DepthFolder(ui)
            self._rig = RigFolder(ui)
            self._noise = NoiseFolder(ui, self._replay, session.cancel_side_job)
        self._uploads = UploadFolder(ui, session.folder, self._use_own)
        with self._group():
            self._lens = LensFolder(ui, self._picked_lens)

    def _group(self) -> Any:
        """Add and return a container that is hidden while there are no photographs."""
        self._groups.append(self.gui.add_folder(None, visible=False))
        return self._groups[-1]

    # The photographs.

    def on_show(self) -> None:
        """Use the scene's photographs if none are in use, and draw results that came meanwhile."""
        self._here = True
        self._noise.show(True)
        if self.session.spec.views is None:
            self._use_own(None)
        if self._undrawn:
            self._draw()

    def on_hide(self) -> None:
        """Hide the scatter in the dock."""
        self._here = False
        self._noise.show(False)

    def _use_own(self, views: BoardViews | None) -> None:
        """Use uploaded photographs; None: those of the scene, once the screen is shown."""
        if views is None and self._here and isinstance(self._source, Demo):
            folder = board_views_of(self._source.name)
            views = None if folder is None else views_in(folder)
        self._use_views(views)

    def _open_scene(self, name: str) -> None:
        self.session.want(replace(self.session.spec, source=Demo(name), views=None))

    def _use_views(self, views: BoardViews | None) -> None:
        if views is not None:
            self._lens.one_camera(not several(views))
            views = replace(views, lens=self._lens.lens, bent=self._lens.bent)
        if views != self.session.spec.views:
            self.session.want(replace(self.session.spec, views=views))
        self._show_camera()

    def on_spec(self, spec: Spec) -> None:
        """Take another scene, which has other cameras; stop a replay of earlier views."""
        moved, taken = inner(spec.source) != self._source, self._had_views and spec.views is None
        self._had_views = spec.views is not None
        if moved or taken:
            self._view, self._whole = None, {}
        if moved:
            self._source = inner(spec.source)
            self._judge.set(None)
        self._use.follow(spec)
        if moved or taken:
            self.ui.post(self._use_own, None)
        if not self.session.results.fresh("calibrate", spec):
            self._noise.forget()
        elif self._view is not None:
            self._show_view()  # its verdict may not have been requested while other settings were chosen

    def on_action(self, action: str) -> None:
        """Ask again for a cancelled verdict on *Retry*."""
        if action == "Retry":
            self._request_answers()

    def on_partial(self, view: Any) -> None:
        """Show the cameras computed so far."""
        if isinstance(view, CalibrationView):
            self._take(view, all_there=False)

    def on_view(self, step: Step, view: Any) -> None:
        """Show all cameras or the new surface's numbers, or take the scene's nodes and their ranges."""
        if step == "scene":
            self._uploads.cameras([node.name for node in view.nodes])
            self._judge.at_range([0.5 * (node.nearest_m + node.farthest_m) for node in view.nodes])
            self._request_answers()
            if not isinstance(self.session.spec.source, Calibrated):
                self._loaded = view
            if self._view is None or AROUND[self._around.value] == "rig":
                self._draw()
        if step == "surface" and self.session.results.fresh("surface", self.session.spec):
            self._use.surface(view.after)
        if step == "calibrate":
            self._take(view, all_there=True)
            self._show_look()

    def on_failure(self, step: Step, sentence: str) -> None:
        """Show why there is no camera."""
        if step == "calibrate":
            self._view = None
            self._show_camera()
            self._status.content = Markdown.escape(sentence)

    def _take(self, view: CalibrationView, all_there: bool) -> None:
        self._view = view
        if view.cameras:
            self._loadedra.offer(tuple(camera.name for camera in view.cameras), all_there)
        self._whole |= {camera.name: camera for camera in view.cameras if not camera.dropped}
        self._show_camera()

    # The camera that is shown.

    def _shown(self) -> CameraView | None:
        return None if self._view is None else self._view.camera(self._loadedra.value)

    def _picked_camera(self) -> None:
        """Show another camera and remove the replay of the last one."""
        self._noise.forget()
        self._show_camera()

    def _show_camera(self) -> None:
        camera = self._shown()
        with self.ui.atomic():
            self._around.visible = camera is not None
            self._loadedras.visible = self._view is not None and len(self._view.cameras) > 1
            self._use.show(camera is not None and camera.calibration is not None)
            nothing = camera is None and self.session.spec.views is None
            self._open.visible = nothing
            for folder in self._groups:
                folder.visible = not nothing
            reason = "" if camera is None else camera.reason
            self._status.content = NOTHING if nothing else Markdown.escape(reason)
            self._show_numbers(camera)
            self._show_view()
        self._draw()

    def _show_numbers(self, camera: CameraView | None) -> None:
        if camera is None or self._view is None:
            self._numbers.content = Markup("")
            self._parameters.load(None)
            self._lens.load(None)
            self._depth.load("")
            self._rig.load(None)
            return
        before = self._whole.get(camera.name)
        pair = [camera] if before is None or not camera.dropped else [camera, before]
        self._numbers.content = summary_table(pair, ("now", "all views") if len(pair) > 1 else ())
        self._parameters.load(camera)
        self._lens.load(camera)
        self._depth.load(self._view.depth.get(camera.name))
        self._rig.load(self._view.rig)
        self._lessons.refresh()

    def _show_view(self) -> None:
        """Show the chosen view, the maps of its pixels and the verdict; ask for what is not computed yet.

        While a camera with a lens is judged, the verdict before stays.
        """
        camera = self._shown()
        trust = None if camera is None else self._answers.trust_in(camera)
        self._photographs.load(camera)
        self._parameters.load_correlations(None if trust is None else trust.together)
        if trust is not None or camera is None or camera.calibration is None:
            self._show_verdict(trust)
        self._request_answers()

    def _show_verdict(self, view: TrustView | None) -> None:
        self._verdict.content = verdict_html(view)
        self._judge.load(view)

    def _pick(self, name: str) -> None:
        """Show another view."""
        self._photographs.chosen = name
        with self.ui.atomic():
            self._show_view()
            self._drawing.choose(name)

    def _drop(self) -> None:
        """Leave the chosen view out, or use it again."""
        camera, views, chosen = self._shown(), self.session.spec.views, self._photographs.chosen
        if camera is None or views is None:
            return
        if not picture_of(camera, chosen).found:
            raise InputError(f"In view {chosen} no board was found, so it is left out already.")
        self._use_views(replace(views, dropped=tuple(sorted(set(views.dropped) ^ {(camera.name, chosen)}))))

    def _keep_all(self) -> None:
        if (views := self.session.spec.views) is not None:
            self._use_views(replace(views, dropped=()))

    def _picked_lens(self) -> None:
        self._whole = {}
        self._use_views(self.session.spec.views)

    # Requests besides the chain.

    def _request_answers(self) -> None:
        """Request the verdict, and the chosen view's depth errors if the chosen pair shows them."""
        camera = self._shown()
        if camera is not None and camera.calibration is not None:
            request = self._judge.request(camera.name)
            self._answers.ask(request, self._photographs.chosen, self._photographs.area.chosen_pair == DEPTH)

    def _judged(self, view: TrustView | None) -> None:
        with self.ui.atomic():
            if view is None:
                self._show_verdict(None)
            self._show_view()

    def _replay(self, replay: int, sigma_px: float, other_lens: bool) -> None:
        camera = self._shown()
        if camera is None or camera.calibration is None:
            raise InputError("There is no calibration to repeat; add photographs first.")
        request = NoiseRequest(camera.name, sigma_px, other_lens)
        self.session.side_job(
            "calibrate.noise_job:noise_job",
            request,
            on_partial=partial(self._noise.load, replay),
            on_end=partial(self._noise.ended, replay),
        )

    @property
    def command(self) -> str:
        """Return the command line that finds the cameras that are shown."""
        views = self.session.spec.views
        return super().command if views is None else calibrate_command(views, self._source)

    # The lesson.

    def _take_look(self, look: CalibrateLook) -> None:
        """Set the controls for a stop; settings that need the cameras wait for them."""
        with self.ui.atomic():
            self._photographs.area.set(look.pair, look.split_share)
            self._around.value = next(name for name, key in AROUND.items() if key == look.around)
            self._judge.set(look.range_m)
            if self._lens.set(look.lens):
                self._whole = {}
            self._noise.forget()
        if not look.used and isinstance(self.session.spec.source, Calibrated):
            self._use.put_back()
        self._lessons.waiting = look
        views = self.session.spec.views
        if views is not None:
            self._use_views(replace(views, dropped=()))
        if self.session.results.fresh("calibrate", self.session.spec):
            self._show_look()

    def _show_look(self) -> None:
        """Apply the stop's settings that need all cameras, once these are computed."""
        look, views = self._lessons.waiting, self.session.spec.views
        if look is None or views is None or not self.session.results.fresh("calibrate", self.session.spec):
            return
        self._lessons.waiting = None
        self._show_camera()
        dropped = sorted(one for camera in self._whole.values() for one in left_out(camera, look.keep))
        if dropped:
            self._use_views(replace(views, dropped=tuple(dropped)))
        if look.noise_px is not None:
            self._noise.set(look.noise_px, look.other_lens)
        if look.used and not isinstance(self.session.spec.source, Calibrated):
            self._use.use()

    def _lesson_numbers(self) -> Numbers:
        """Return the numbers of the camera that is shown; empty while it is computed."""
        session, view, camera = self.session, self._view, self._shown()
        scene: SceneView | None = session.results.view("scene")
        fresh = session.results.fresh("calibrate", session.spec)
        if scene is None or view is None or camera is None or not fresh:
            return {}
        return numbers(scene.title, len(view.board.points_m), camera)

    # Drawing.

    def _draw(self) -> None:
        self._undrawn = not self._here
        if self._undrawn:
            return
        camera, view, around = self._shown(), self._view, AROUND[self._around.value]
        scene = self.session.results.view("scene")
        with self.ui.atomic():
            self._no_rig.visible = False
            if view is None or camera is None or camera.calibration is None:
                self._drawing.draw_scene(scene)
            elif around == "rig" and isinstance(view.rig, RigView):
                self._drawing.draw_rig(view, view.rig, scene, self._loaded, self._photographs.chosen)
            else:
                self._no_rig.visible = around == "rig"
                self._drawing.draw_camera(camera, view.board, around, self._photographs.chosen)
        self.session.frame_view()

    def look(self) -> bool:
        """Turn the view to new boards. False for the cameras of a rig: the session shows the whole scene."""
        camera, around = self._shown(), AROUND[self._around.value]
        if camera is None or camera.calibration is None or around == "rig":
            self._framed = ()
            return False
        clients = list(self.session.clients())
        framed = (camera.name, around, len(camera.photographs), *(client.client_id for client in clients))
        if framed != self._framed:
            self._framed, stage = framed, place_of(camera, around)
            for client in clients:
                stand_before(client, stage)
        return True
