"""The folder of all cameras together: their poses and uncertainties."""

from __future__ import annotations

import numpy as np

from app.screens.calibrate.view import RigView
from app.web.markup import Markdown, Markup
from app.window.tables import number, table
from app.window.ui import Ui

TEXT = Markdown(
    """Photographs that several cameras took of the board at the same moment give their poses relative to
each other. Choose **cameras of the rig** under *In space*: grey are the scene's poses, blue the estimated
ones."""
)
MEANING = (
    "Distance from the first camera, standard errors of position and rotation, and the number of moments "
    "at which both cameras see the board."
)


class RigFolder:
    """The poses of the cameras."""

    def __init__(self, ui: Ui) -> None:
        """Add the folder."""
        self._folder = ui.gui.add_folder("Where the cameras stand", expand_by_default=False, visible=False)
        with self._folder:
            ui.gui.add_markdown(TEXT)
            self._table = ui.gui.add_html(Markup(""))
            self._text = ui.gui.add_markdown(Markdown(""))

    def load(self, rig: RigView | str | None) -> None:
        """Show another rig; a text is the reason why there is none, None hides the folder."""
        self._folder.visible = rig is not None
        self._table.content = rig_table(rig) if isinstance(rig, RigView) else Markup("")
        self._text.content = rig_line(rig) if isinstance(rig, RigView) else Markdown.escape(rig or "")


def rig_table(rig: RigView) -> Markup:
    """Return a table in HTML with a line for each camera but the first."""
    rows = []
    for one in rig.cameras[1:]:
        away_m = float(np.linalg.norm(one.T_first_camera[:3, 3]))
        rows.append(
            (
                one.name,
                MEANING,
                f"{away_m:.4f} m",
                number(one.position_sd_m, 2, "mm", 1000.0),
                number(one.rotation_sd_deg, 4, "°"),
                str(one.moments),
            )
        )
    return table(rows, (f"from {rig.cameras[0].name}", "± position", "± rotation", "moments"))


def rig_line(rig: RigView) -> Markdown:
    """Return a sentence on the fit of the whole rig and on held-out moments."""
    rms_text = f"RMS over all cameras {rig.rms_px:.3f} px"
    if rig.held_out_rms_px is None:
        return Markdown("{}; there are too few shared moments to hold some out.").format(rms_text)
    moved = [one.held_out_position_m for one in rig.cameras[1:] if one.held_out_position_m is not None]
    return Markdown(
        "{}, {:.3f} px at held-out moments; leaving out a quarter of the moments moves no camera by more "
        "than {:.2f} mm."
    ).format(rms_text, rig.held_out_rms_px, 1000.0 * max(moved, default=0.0))
