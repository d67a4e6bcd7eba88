"""The folder for uploads: a pair of images, or a recording."""

from __future__ import annotations

import re
import shutil
from collections.abc import Callable
from pathlib import Path

import viser

from app.web.markup import Markdown
from app.web.uploads import OWN, keep_upload
from app.window.ui import Ui
from packetmesh.errors import InputError
from packetmesh.files import path_below
from pipeline.sources import ImagePair
from pipeline.types import MAX_NODES

PAIR_LIMIT_BYTES = 64 << 20
RECORDING_LIMIT_BYTES = 256 << 20
IMAGES = "image/*,.pgm,.ppm,.tif,.tiff,.npy,.pfm,.exr"
FILES = {
    "color": ("Colour image …", IMAGES),
    "depth": ("Depth image …", IMAGES),
    "intrinsics": ("Intrinsics …", ".json,.yaml,.yml,.txt"),
}
RECORDINGS = ".zip,.bag,.mcap,.db3,.r3d,.sens,.mkv,application/zip"
PAIR_TEXT = Markdown(
    """**A pair**: colour, depth (16 bits, or metres in floating point) and the camera's
intrinsics (JSON, YAML or a 3 × 3 matrix)."""
)
RECORDING_TEXT = Markdown(
    """**A recording**: a bag of ROS, a .r3d of Record3D, .sens of ScanNet or .mkv of Azure Kinect, or
a ZIP of a rig (node_00, node_01 …) or of a folder of TUM, 7-Scenes, ScanNet, SUN RGB-D, Redwood,
Open3D, COLMAP or a telephone's app, or of a pair (color.png, depth.png, intrinsics.json)."""
)
MOMENTS, WALK = "some of its frames, as nodes", "one surface, from all its frames"
"""What a recording becomes."""
INSTEAD = "use packetmesh import and reconstruct for larger files"


class OwnFolder:
    """Upload buttons, the unit of depth, and a button that reconstructs the pair."""

    def __init__(
        self,
        ui: Ui,
        below: Path,
        new_folder: Callable[[], Path],
        on_pair: Callable[[ImagePair], None],
        on_recording: Callable[[Path, str, float | None, int | None], None],
    ) -> None:
        """Add the folder.

        Args:
            ui: panel to add it to.
            below: folder of the session.
            new_folder: makes a folder for one upload.
            on_pair: called with a pair to reconstruct.
            on_recording: called with the file of a recording, a name for its rig, depth units per metre or
                None, and the number of frames that become nodes or None for all as one surface.
        """
        self._ui, self._below, self._new_folder = ui, below, new_folder
        self._on_pair, self._on_recording = on_pair, on_recording
        self._files: dict[str, Path] = {}
        gui = ui.gui
        with gui.add_folder("Use your own images", expand_by_default=False):
            self._scale = gui.add_number(
                "Units per m",
                0.0,
                min=0.0,
                max=100_000.0,
                step=1.0,
                hint="Depth units in one metre (--depth-scale): 5000 for TUM's images. 0: millimetres "
                "for whole numbers and metres for floating point, or the unit of the kind of "
                "recording.",
            )
            gui.add_markdown(PAIR_TEXT)
            for kind, (label, mime) in FILES.items():
                self._add_button(label, mime, self._keep_file, kind)
            self._have = gui.add_markdown(Markdown("Add all three files, then press the button."))
            gui.add_button("Reconstruct this pair", icon=viser.Icon.PLAYER_PLAY).on_click(
                lambda _: ui.post(self._use_files)
            )
            gui.add_markdown(RECORDING_TEXT)
            self._becomes = gui.add_dropdown(
                "It becomes",
                [MOMENTS, WALK],
                hint="Some frames are nodes of a rig, which are registered to one another. For one surface, "
                "the path of the one camera that walked (or stood) is found from all frames.",
            )
            ui.when_changed(self._becomes, self._show_frames)
            self._frames = gui.add_number(
                "Frames",
                3,
                min=1,
                max=MAX_NODES,
                step=1,
                hint="Number of frames taken from a recording; each becomes a node.",
            )
            self._add_button("Recording …", RECORDINGS, self._keep_recording)
            self._notes = gui.add_markdown(Markdown(""))

    def show_notes(self, notes: tuple[str, ...]) -> None:
        """Show the notes on a recording; none clears them."""
        self._notes.content = Markdown("\n").join(Markdown("- {}").format(note) for note in notes)

    def _show_frames(self) -> None:
        self._frames.visible = self._becomes.value == MOMENTS

    def _add_button(self, label: str, mime: str, action: Callable[..., None], *arguments: str) -> None:
        button = self._ui.gui.add_upload_button(label, icon=viser.Icon.UPLOAD, mime_type=mime)
        button.on_upload(lambda event: self._ui.post(action, *arguments, event.target.value))

    def _keep_file(self, kind: str, file: viser.UploadedFile) -> None:
        self._files[kind] = keep_upload(file, self._below / kind, PAIR_LIMIT_BYTES, INSTEAD)
        missing = [name for name in FILES if name not in self._files]
        self._have.content = (
            Markdown("Still needed: {}.").format(", ".join(missing))
            if missing
            else Markdown("All three are there: press the button.")
        )

    def _use_files(self) -> None:
        if len(self._files) < len(FILES):
            raise InputError("A pair needs a colour image, a depth image and intrinsics; add all three.")
        folder, files = self._new_folder() / OWN, dict[str, str]()
        folder.mkdir()
        for kind, path in self._files.items():
            place = path_below(folder, path.name)
            if place.exists():  # for example if images of both kinds are numbered alike
                place = path_below(folder, kind, path.name)
                place.parent.mkdir()
            files[kind] = str(shutil.copyfile(path, place))
        self._on_pair(ImagePair(**files, depth_scale=self._depth_scale))

    def _keep_recording(self, file: viser.UploadedFile) -> None:
        path = keep_upload(file, self._new_folder() / OWN, RECORDING_LIMIT_BYTES, INSTEAD)
        self.show_notes(("Reading the recording …",))
        stem = re.sub(r"[^A-Za-z0-9._-]+", "-", Path(file.name).stem).strip(".-")[:40]
        frames = int(self._frames.value) if self._becomes.value == MOMENTS else None
        self._on_recording(path, stem or "rig", self._depth_scale, frames)

    @property
    def _depth_scale(self) -> float | None:
        return float(self._scale.value) or None
