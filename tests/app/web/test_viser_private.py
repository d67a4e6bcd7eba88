import asyncio
import threading
import typing
from collections import deque

import pytest
import viser
from viser._assignable_props_api import AssignablePropsBase
from viser._messages import GuiSliderProps, GuiUpdateMessage
from websockets.sync.client import connect

from app.load.connection import Connection
from app.server import build_server
from app.web import viser_private
from app.web.viser_private import AnyThreadEvent


class _Changing(deque):
    """Waiters that the loop changes while another thread looks at them."""

    def __iter__(self):
        raise RuntimeError("deque mutated during iteration")


def test_another_thread_sets_without_a_look_at_who_waits():
    plain, ours = asyncio.Event(), AnyThreadEvent()
    for event in (plain, ours):
        event._waiters = _Changing()
    with pytest.raises(RuntimeError):
        plain.set()
    ours.set()
    assert ours.is_set()


def test_the_loops_own_call_wakes_who_waits_after_another_thread_has_set():
    async def wait() -> bool:
        event, loop = AnyThreadEvent(), asyncio.get_running_loop()

        def queue() -> None:
            event.set()
            loop.call_soon_threadsafe(event.set)

        waiting = asyncio.create_task(event.wait())
        await asyncio.sleep(0)
        thread = threading.Thread(target=queue)
        thread.start()
        woken = await asyncio.wait_for(waiting, 5.0)
        thread.join()
        return woken

    assert asyncio.run(wait())


def test_the_hints_of_a_kind_of_control_are_evaluated_once(monkeypatch):
    evaluated = []

    def evaluate(kind):
        evaluated.append(kind)
        return typing.get_type_hints(kind)

    monkeypatch.setattr(AssignablePropsBase, "_prop_hints", AssignablePropsBase._prop_hints)
    monkeypatch.setattr(viser_private, "get_type_hints", evaluate)
    viser_private.remember_hints()
    server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    try:
        one, two = (server.gui.add_slider(name, 0.0, 1.0, 0.5, 0.0) for name in ("one", "two"))
        two.max = 2.0
        assert one._prop_hints == typing.get_type_hints(GuiSliderProps)
        assert (one.max, two.max) == (1.0, 2.0)
        with pytest.raises(AttributeError):
            two.no_such_property  # noqa: B018
    finally:
        server.stop()
    assert evaluated.count(GuiSliderProps) == 1


def test_a_browsers_clicks_are_handled_in_their_order():
    server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    handled, slow, done = [], threading.Event(), threading.Event()
    try:
        viser_private.call_in_order(server)
        first, second = server.gui.add_button("first"), server.gui.add_button("second")
        first.on_click(lambda _: (slow.wait(0.3), handled.append("first")))
        second.on_click(lambda _: (handled.append("second"), done.set()))
        page = Connection(f"http://127.0.0.1:{server.get_port()}")
        for button in (first, second):
            page.send(GuiUpdateMessage(button._impl.uuid, {"value": True}))
        assert done.wait(30.0)
        page.close()
    finally:
        server.stop()
    assert handled == ["first", "second"]


@pytest.mark.parametrize("lecture", [False, True], ids=["a session each", "lecture"])
def test_the_app_queues_with_it_to_all_and_to_each_browser(lecture):
    app = build_server("box-on-table", port=0, lecture=lecture)
    server = app.viser_server
    try:
        address = f"ws://127.0.0.1:{server.get_port()}"
        protocols = [f"viser-v{viser.__version__}"]
        with connect(address, subprotocols=protocols, max_size=None, proxy=None) as browser:
            assert browser.recv(timeout=30.0)
            states = list(server._websock_server._client_state_from_id.values())
            buffers = [
                server._websock_server.get_message_buffer(),
                *(state.message_buffer for state in states),
            ]
            assert len(buffers) == 2
            assert all(isinstance(buffer.message_event, AnyThreadEvent) for buffer in buffers)
    finally:
        app.stop()


def test_controls_are_found_with_the_titles_around_them_unless_they_are_hidden(server):
    gui = server.gui
    with gui.add_folder(None) as screen:
        gui.add_slider("Radius", 0, 1, 1, 0)
        with gui.add_folder("Advanced"):
            with gui.add_tab_group().add_tab("Noise"):
                gui.add_checkbox("Average", False)
            gui.add_checkbox("Gone", False, visible=False)
        with gui.add_folder("Closed", visible=False):
            gui.add_checkbox("Inside", False)
    found = [(one.label, titles) for one, titles in viser_private.contents(screen) if hasattr(one, "label")]
    assert found == [("Radius", ()), ("Advanced", ()), ("Average", ("Advanced", "Noise"))]
