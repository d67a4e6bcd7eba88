"""The status line at the top of the panel."""

import pytest

from app.window.gui import Gui as PanelGui
from app.window.header import Header
from tests.app.fakes import Gui


@pytest.mark.parametrize("failure", ["There is no surface; try a larger ball", "Cancelled."])
def test_an_error_and_the_advice_after_it_are_two_sentences(failure):
    gui = Gui()
    header = Header(PanelGui(gui), ("Scene",), lambda title: None, lambda action: None)
    header.show("Scene", {"Scene": "failed"}, (), failure, busy=False)
    assert f"{failure.rstrip('.')}. Change a setting or press Retry." in gui.text()
