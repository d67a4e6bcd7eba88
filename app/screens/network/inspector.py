"""The folder that describes the picked frame and highlights what it carried."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from app.screens.network.delivery_draw import DeliveryDrawing
from app.screens.network.delivery_view import DeliveryView, PacketView
from app.screens.network.labels import PICK
from app.screens.network.packets import Frames, packet_sentence
from app.web.markup import Markdown
from app.window.ui import Ui

if TYPE_CHECKING:
    from app.window.panel import PanelSession


class Inspector:
    """The folder of one packet."""

    def __init__(self, ui: Ui, session: PanelSession) -> None:
        """Add the folder to the current container."""
        self._ui, self._session = ui, session
        self._frames: Sequence[Frames] = ()
        self._view: DeliveryView | None = None
        self._drawing: DeliveryDrawing | None = None
        self._picked: tuple[int, int, DeliveryDrawing | None] = -1, -1, None
        """Lane, index and drawing of the frame that is described."""
        with ui.gui.add_folder("Packet"):
            self._text = ui.gui.add_markdown(PICK)

    def load(
        self,
        frames: Sequence[Frames],
        view: DeliveryView | None = None,
        drawing: DeliveryDrawing | None = None,
    ) -> None:
        """Take other frames and describe none of them yet.

        Args:
            frames: the frames of each lane of the timeline.
            view: their delivery; None for frames of vehicles.
            drawing: drawing in which pixels and points are highlighted.
        """
        self._frames, self._view, self._drawing = frames, view, drawing
        self._picked = -1, -1, drawing
        self._text.content = PICK

    def pick(self, lane: int, item: int) -> None:
        """Describe a frame and highlight what it carried; a negative ``item`` is none."""
        picked = self._picked = lane, item, self._drawing
        if self._drawing is not None:
            self._drawing.light(None)
        if item < 0 or lane >= len(self._frames):
            self._text.content = PICK
            return
        frames, view = self._frames[lane], self._view
        story = frames.story(item)
        self._text.content = story
        if view is None or not frames.carries_image(item):
            return
        source = view.image_row(frames.camera_of(item), int(frames.pieces.image[item]))
        if source is not None:
            first, count = frames.bytes_of(item)

            def came(packet: PacketView | None) -> None:
                if picked == self._picked:
                    self._light(story, packet)

            self._session.quick_job("network.delivery_job:packet_job", source, first, count, on_end=came)

    def _light(self, story: Markdown, packet: PacketView | None) -> None:
        if packet is None or self._drawing is None:
            return
        self._text.content = Markdown("{}\n\n{}").format(story, packet_sentence(packet))
        with self._ui.atomic():
            self._drawing.light(packet)
