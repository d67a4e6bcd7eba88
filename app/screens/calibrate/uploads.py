"""The folder for uploaded photographs of a board."""

from __future__ import annotations

import io
import re
from collections.abc import Callable, Sequence
from itertools import count
from pathlib import Path, PurePosixPath
from typing import get_args

import viser

from app.compute.state import BoardViews
from app.screens.calibrate.request import shots_of, views_in
from app.web.markup import Markdown
from app.web.zips import opened_zip
from app.window.ui import Ui
from packetmesh.errors import InputError
from packetmesh.files import atomic_path, path_below, unpacked
from pipeline.calibration.shots import BOARD_FILE, moment_of
from pipeline.config import Pattern

TEXT = Markdown(
    """Photograph a flat board of circles or squares from eight or more directions, tilted by 20 to 40°,
also in the corners of the image. `packetmesh target` draws one to print. Add the photographs one by one, or
all in a ZIP, with a folder for each camera (node_00, node_01 …) if there are several; depth images in the
same folder (depth_05.png for color_05.png) also calibrate the depth sensor."""
)
ENDINGS = (".png", ".jpg", ".jpeg")
UPLOAD_LIMIT_BYTES = 64 << 20
UNPACKED_LIMIT_BYTES = 256 << 20
MOST_FILES = 240
INSTEAD = "use packetmesh calibrate for larger files"
NONE = Markdown("No photograph yet.")


class UploadFolder:
    """Upload buttons, the board's pattern, and a button that finds the cameras."""

    def __init__(self, ui: Ui, below: Path, on_views: Callable[[BoardViews | None], None]) -> None:
        """Add the folder.

        Args:
            ui: panel to add it to.
            below: folder of the session.
            on_views: called with the photographs to use; None for the scene's own.
        """
        self._on_views, self._below = on_views, below
        self._edition = 0
        self._folder: Path | None = None
        gui = ui.gui
        with gui.add_folder("Use your own photographs", expand_by_default=False):
            gui.add_markdown(TEXT)
            self._node = gui.add_dropdown(
                "Taken by", ["node_00"], hint="Camera that took the photographs that you add one by one."
            )
            mime = "image/png,image/jpeg,application/zip,.zip"
            button = gui.add_upload_button("Photograph or ZIP …", icon=viser.Icon.UPLOAD, mime_type=mime)
            button.on_upload(lambda event: ui.post(self._keep, event.target.value))
            self._have = gui.add_markdown(NONE)
            self._pattern = gui.add_dropdown("Board", list(get_args(Pattern)), hint="Pattern on the board.")
            self._columns = gui.add_number(
                "Columns", 11, min=2, max=50, step=1, hint="Circles, inner corners or AprilTags."
            )
            self._rows = gui.add_number(
                "Rows", 9, min=2, max=50, step=1, hint="Circles, inner corners or AprilTags."
            )
            self._spacing = gui.add_number(
                "Spacing (mm)",
                35.0,
                min=1.0,
                max=1000.0,
                step=0.1,
                hint="Pitch of circles, or side of a square or of an AprilTag.",
            )
            ui.buttons(
                "Photographs",
                {"Find the cameras": self._use, "Forget them": self.forget},
                "Find the cameras: calibrate with these photographs. Forget them: go back to the scene's "
                "photographs.",
            )

    def cameras(self, names: Sequence[str]) -> None:
        """Set the cameras to choose from."""
        if tuple(names) != self._node.options:
            self._node.options = tuple(names)

    def forget(self) -> None:
        """Return to the scene's own photographs."""
        if self._folder is not None:
            self._folder, self._have.content = None, NONE
            self._on_views(None)

    def _keep(self, file: viser.UploadedFile) -> None:
        if self._folder is None:
            self._folder = self._below / f"photographs_{self._edition:03d}"
        self._edition += 1
        kept = keep_photographs(file, self._folder, self._node.value)
        views = views_in(self._folder)
        if BOARD_FILE in kept:
            self._write(views)
        total = sum(len(node.shots) for node in shots_of(views))
        noun = "photograph" if total == 1 else "photographs"
        self._have.content = Markdown(
            "**{} {}**, the last {}. Add more, or press *Find the cameras*."
        ).format(total, noun, kept[-1])

    def _write(self, views: BoardViews) -> None:
        """Show the board that a ZIP describes."""
        self._pattern.value = views.pattern
        self._columns.value, self._rows.value = views.columns, views.rows
        self._spacing.value = 1000.0 * views.spacing_m

    def _use(self) -> None:
        if self._folder is None or not self._folder.exists():
            raise InputError("There is no photograph to look at; add some first.")
        known = views_in(self._folder)
        self._on_views(
            BoardViews(
                str(self._folder),
                self._edition,
                self._pattern.value,
                int(self._columns.value),
                int(self._rows.value),
                self._spacing.value / 1000.0,
                known.dictionary if known.pattern == self._pattern.value else "",
                known.tag_spacing,
            )
        )


def keep_photographs(file: viser.UploadedFile, folder: Path, node: str) -> list[str]:
    """Keep a photograph, or all of a ZIP, below ``folder`` as ``NODE/NAME``, and a ZIP's board.json.

    Returns:
        Paths of the kept files below ``folder``.

    Raises:
        InputError: the upload is too large, an unreadable ZIP, holds no photograph or two of the same place,
            or makes too many files.
    """
    if len(file.content) > UPLOAD_LIMIT_BYTES:
        raise InputError(
            f"{file.name} has {len(file.content) >> 20} MB; the app takes up to {UPLOAD_LIMIT_BYTES >> 20} "
            f"MB, so {INSTEAD}."
        )
    if file.name.lower().endswith(".zip"):
        photographs = _unpacked(file, node)
    elif file.name.lower().endswith(ENDINGS):
        photographs = {_free_place(folder, _place(file.name, node), file.content): file.content}
    else:
        raise InputError(f"{file.name} is no photograph; try PNG or JPEG, or a ZIP of them.")
    there = len(list(folder.glob("*/*")))
    if there + len(photographs) > MOST_FILES:
        raise InputError(f"The app takes up to {MOST_FILES} images; {INSTEAD}.")
    for place, content in photographs.items():
        with atomic_path(path_below(folder, place)) as temporary:
            temporary.write_bytes(content)
    return list(photographs)


def _unpacked(file: viser.UploadedFile, node: str) -> dict[str, bytes]:
    sentence = f"{file.name} cannot be read as a ZIP; pack the photographs again."
    with opened_zip(io.BytesIO(file.content), sentence) as archive:
        inside = [one for one in archive.infolist() if one.filename.lower().endswith((*ENDINGS, BOARD_FILE))]
        if sum(one.file_size for one in inside) > UNPACKED_LIMIT_BYTES:
            raise InputError(f"{file.name} unpacks to more than {UNPACKED_LIMIT_BYTES >> 20} MB; {INSTEAD}.")
        found = dict[str, bytes]()
        for one in inside:
            if _path(one.filename).name.startswith("."):
                continue
            place, content = _place(one.filename, node), unpacked(archive, one)
            if found.setdefault(place, content) != content and place == BOARD_FILE:
                raise InputError(f"{file.name} has several {BOARD_FILE} that differ; leave one.")
            if found[place] != content:
                raise InputError(
                    f"{file.name} has several files for {place}, one of them {one.filename}; give each "
                    "photograph its own name, and each camera its own folder: node_00, node_01 and so on."
                )
    if not set(found) - {BOARD_FILE}:
        raise InputError(f"{file.name} holds no PNG or JPEG; try a ZIP of photographs.")
    return found


def _place(name: str, node: str) -> str:
    """Return ``NODE/NAME`` for a file: NODE is a folder such as node_00 in its path, or else ``node``."""
    path = _path(name)
    if path.name == BOARD_FILE:
        return BOARD_FILE
    named = next((part for part in path.parts[:-1] if re.fullmatch(r"node_\d\d", part)), node)
    return f"{named}/{re.sub(r'[^A-Za-z0-9._-]', '-', path.name)[-60:]}"


def _free_place(folder: Path, place: str, content: bytes) -> str:
    """Return the place of a photograph below ``folder``. One without a number in its name gets that of a
    moment without a photograph: a telephone may name each of its pictures image.jpg. One with a number
    replaces that of its name.
    """
    path, there = PurePosixPath(place), path_below(folder, place)
    if moment_of(path.stem) != path.stem:
        return place
    beside = {other.stem: other for other in there.parent.glob("*")}
    for stem, other in beside.items():
        if stem.startswith(path.stem) and other.read_bytes() == content:
            return str(path.with_name(other.name))
    taken = {moment_of(stem) for stem in beside}
    number = next(number for number in count(1) if str(number) not in taken)
    return str(path.with_stem(f"{path.stem}-{number}"))


def _path(name: str) -> PurePosixPath:
    """Return a file's path, written with slashes or backslashes."""
    return PurePosixPath(name.replace("\\", "/"))
