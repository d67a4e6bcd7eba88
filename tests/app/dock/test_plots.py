"""What a page is told of the plots in the dock."""

import plotly.graph_objects as go

from app.dock.plots import PlotDock, Sheet
from tests.app.fakes import page_calls, ui_of

SHEET = Sheet("Trials", "<i></i>dots", (go.Figure(),), "<table></table>")


def told(ui):
    """The last that a page was told."""
    contents = [str(getattr(one, "content", "")) for one in ui.gui.handles]
    ((name, (message,)),) = [call for content in contents for call in page_calls(content)]
    assert name == "plots"
    return message


def test_nothing_is_seen_before_there_is_something_and_somebody_looks():
    ui = ui_of()
    dock = PlotDock(ui)
    dock.show(True)
    assert not told(ui)["visible"]
    dock.load(SHEET)
    message = told(ui)
    assert message["visible"]
    assert (message["title"], message["legend"], message["table"]) == (
        "Trials",
        "<i></i>dots",
        "<table></table>",
    )
    assert len(message["figures"]) == 1
    dock.show(False)
    assert "figures" not in told(ui)
    dock.show(True)
    assert told(ui)["visible"]
    dock.load(None)
    assert not told(ui)["visible"]


def test_what_begins_anew_is_another_run():
    ui = ui_of()
    dock = PlotDock(ui)
    dock.show(True)
    dock.load(SHEET)
    before = told(ui)["run"]
    dock.load(SHEET)
    assert told(ui)["run"] == before
    dock.begin()
    dock.load(SHEET)
    assert told(ui)["run"] != before
