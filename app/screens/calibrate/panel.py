"""Calibrate: the cameras from photographs of a board, and how far to believe them."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import replace
from typing import Any, ClassVar, get_args

from app.drawing.cameras import turn
from app.screens.calibrate.area import PictureArea
from app.screens.calibrate.bars import Bar, Bars
from app.screens.calibrate.draw import BELOW, Around, BoardsDrawing, place_of
from app.screens.calibrate.noise import NoiseFolder
from app.screens.calibrate.noise_view import NoiseRequest, NoiseView
from app.screens.calibrate.numbers import parameter_table, summary_table
from app.screens.calibrate.photograph import found_picture, picture_of, straightened_picture
from app.screens.calibrate.uploads import UploadFolder
from app.screens.calibrate.view import CalibrationView, CameraView
from app.state import BoardViews, Spec, Step
from app.ui import Panel
from packetmesh.errors import InputError
from pipeline.config import Lens

TEXT = """**What you see.** Photographs of a board of known size tell how each camera bends what it sees, and
where the board stood: click a bar, a board or a photograph. What counts is not how well the lens explains these
views, but how sure it is of **others**. Go on with **Depth**."""
AROUND: dict[str, Around] = {"boards around the camera": "camera", "cameras around the board": "board"}
RIGHT = {"straightened": "straightened photograph"}


class CalibratePanel(Panel):
    """Views of a board, the cameras they tell, and whether to trust them."""

    title = "Calibrate"
    step: ClassVar[Step | None] = "calibrate"
    drawn_below = BELOW
    only_when_shown: ClassVar[bool] = True

    def build(self) -> None:
        """Camera, bars, views, the split picture, the stage; numbers; the rest in folders."""
        gui, ui = self.gui, self.ui
        self._source = self.session.spec.source
        self._here = False
        self._own: BoardViews | None = None
        self._view: CalibrationView | None = None
        self._whole: dict[str, CameraView] = {}
        """Every camera before a view of it was dropped."""
        self._chosen = ""
        self._framed: tuple[Hashable, ...] = ()
        gui.add_markdown(TEXT)
        self._status = gui.add_markdown("")
        self._camera = gui.add_dropdown("Camera", ["node_00"], hint="Whose views are shown.", visible=False)
        ui.when_changed(self._camera, self._show_camera)
        self._bars = Bars(ui, self._pick)
        self._row = ui.buttons(
            "View",
            {
                "Back": lambda: self._go(-1),
                "Next": lambda: self._go(1),
                "Drop": self._drop,
                "All": self._keep_all,
            },
            "Back, Next: the view before or after. Drop: leave this one out, or take it in again. All: leave none "
            "out.",
            visible=False,
        )
        self._area = PictureArea(ui, RIGHT, "straightened")
        self._around = gui.add_dropdown(
            "In space", list(AROUND), hint="What stays in its place in the 3-D scene."
        )
        ui.when_changed(self._around, self._draw)
        self._numbers = gui.add_html("")
        self._build_folders()
        self._drawing = BoardsDrawing(self.scene, lambda name: ui.post(self._pick, name))
        self._show_camera()

    def _build_folders(self) -> None:
        gui, ui, session = self.gui, self.ui, self.session
        with gui.add_folder("Every parameter, and how sure it is", expand_by_default=False):
            self._parameters = gui.add_html("")
        self._noise = NoiseFolder(ui, self._replay, session.cancel_side_job)
        self._uploads = UploadFolder(ui, session.folder, self._use_own)
        with gui.add_folder("Advanced", expand_by_default=False):
            self._lens = gui.add_dropdown(
                "Lens",
                list(get_args(Lens)),
                hint="Which distortions the camera may have: k1 and k2 (thesis), also p1, p2, k3 (brown), or k4 to "
                "k6 as well (rational).",
            )
            ui.when_changed(self._lens, self._picked_lens)

    # What there is to calibrate from.

    def on_show(self) -> None:
        """Look for the board at the first visit."""
        self._here = True
        if self.session.spec.views is None:
            self._want(self._of_scene() if self._own is None else self._own)

    def on_hide(self) -> None:
        """Another step is shown."""
        self._here = False

    def _of_scene(self) -> BoardViews | None:
        """The board views of the scene; None if it has none."""
        return None

    def _use_own(self, views: BoardViews | None) -> None:
        self._own = views
        self._want(self._of_scene() if views is None else views)

    def _want(self, views: BoardViews | None) -> None:
        if views is not None:
            views = replace(views, lens=self._lens.value)
        self.session.want(replace(self.session.spec, views=views))

    def on_spec(self, spec: Spec) -> None:
        """Another scene has other cameras; what is replayed belongs to the views before."""
        if spec.source != self._source:
            self._source, self._own = spec.source, None
            if spec.views is not None:
                self.ui.post(self._want, None)
        if spec.views is None and self._here:
            self.ui.post(self.on_show)
        if not self.session.results.fresh("calibrate", spec):
            self._noise.forget()

    def on_partial(self, view: Any) -> None:
        """Show the cameras as they come."""
        if isinstance(view, CalibrationView):
            self._take(view)

    def on_view(self, step: Step, view: Any) -> None:
        """Show all cameras."""
        if step == "scene":
            self._uploads.cameras([node.name for node in view.nodes])
        if step == "calibrate":
            self._take(view)

    def on_failure(self, step: Step, sentence: str) -> None:
        """Say why there is no camera."""
        if step == "calibrate":
            self._status.content = sentence

    def _take(self, view: CalibrationView) -> None:
        self._view = view
        names = tuple(camera.name for camera in view.cameras)
        if names != self._camera.options:
            self._camera.options = names
        for camera in view.cameras:
            if not camera.dropped:
                self._whole[camera.name] = camera
        self._show_camera()

    # The camera that is shown.

    def _shown(self) -> CameraView | None:
        return None if self._view is None else self._view.camera(self._camera.value)

    def _show_camera(self) -> None:
        camera = self._shown()
        there = camera is not None
        with self.ui.atomic():
            for handle in (self._row, self._around):
                handle.visible = there
            self._camera.visible = self._view is not None and len(self._view.cameras) > 1
            if camera is None:
                self._area.load(None, {})
                return
            if self._chosen not in [one.name for one in camera.photographs]:
                self._chosen = camera.photographs[0].name
            before = self._whole.get(camera.name)
            pair = [camera] if before is None or not camera.dropped else [camera, before]
            self._numbers.content = summary_table(pair, ("now", "all views") if len(pair) > 1 else ())
            self._parameters.content = parameter_table(camera.calibration)
            self._status.content = camera.reason
            self._show_view()
        self._draw()

    def _show_view(self) -> None:
        camera = self._shown()
        if camera is None:
            return
        photograph = picture_of(camera, self._chosen)
        left = found_picture(photograph, camera.fitted(photograph.name))
        right = {}
        if camera.calibration is not None:
            right["straightened"] = straightened_picture(photograph, camera.calibration)
        self._area.load(left, right)
        self._bars.show(bars_of(camera), self._chosen)

    def _pick(self, name: str) -> None:
        """Show another view."""
        self._chosen = name
        with self.ui.atomic():
            self._show_view()
            self._drawing.choose(name)

    def _go(self, count: int) -> None:
        camera = self._shown()
        if camera is not None:
            names = [one.name for one in camera.photographs]
            self._pick(names[(names.index(self._chosen) + count) % len(names)])

    def _drop(self) -> None:
        """Leave the chosen view out, or take it in again."""
        camera, views = self._shown(), self.session.spec.views
        if camera is None or views is None:
            return
        one = (camera.name, self._chosen)
        if not picture_of(camera, self._chosen).found:
            raise InputError(f"In view {self._chosen} no board was found, so it is left out already.")
        left = set(views.dropped) ^ {one}
        self._want(replace(views, dropped=tuple(sorted(left))))

    def _keep_all(self) -> None:
        views = self.session.spec.views
        if views is not None:
            self._want(replace(views, dropped=()))

    def _picked_lens(self) -> None:
        if self.session.spec.views is not None:
            self._want(self.session.spec.views)

    # What is drawn.

    def _draw(self) -> None:
        camera, around = self._shown(), AROUND[self._around.value]
        if self._view is None:
            return
        with self.ui.atomic():
            self._drawing.draw(camera, self._view.board, around, self._chosen)
        if self._here:
            self.look()

    def look(self) -> bool:
        """Turn the view to the boards when there are others."""
        camera, around = self._shown(), AROUND[self._around.value]
        stage = None if camera is None else place_of(camera, around)
        if camera is None or stage is None:
            return False
        framed = (camera.name, around, len(camera.photographs))
        if framed != self._framed:
            self._framed = framed
            for client in self.session.clients():
                turn(client, stage.middle_m, stage.viewpoint_m)
        return True

    # The noise experiment.

    def _replay(self, sigma_px: float) -> None:
        camera = self._shown()
        if camera is None or camera.calibration is None:
            raise InputError("There is no calibration to repeat; add photographs first.")
        request = NoiseRequest(camera.name, sigma_px)

        def shown(view: Any) -> None:
            if isinstance(view, NoiseView):
                self._noise.load(view)

        self.session.side_job(
            "calibrate.noise_job:noise_job",
            request,
            on_partial=shown,
            on_end=lambda view: self._noise.ended(view, request),
        )


def bars_of(camera: CameraView) -> tuple[Bar, ...]:
    """A bar for each photograph."""
    bars = []
    for photograph in camera.photographs:
        fitted = camera.fitted(photograph.name)
        bars.append(
            Bar(
                photograph.name,
                None if fitted is None else fitted.rms_px,
                camera.unseen_rms_px(photograph.name),
                photograph.name in camera.dropped,
            )
        )
    return tuple(bars)
