"""Access to viser's private parts that the app needs, each with its reason. Viser's version is pinned for
this.

- ``queue_from_any_thread``: viser 1.1 sets an ``asyncio.Event`` on the thread that queues a message, then
lets the event loop set it again. asyncio's events are not thread-safe: if the loop begins to wait at that
moment, ``set`` fails with "deque mutated during iteration", once in some thousand visits, and leaves a page
half built.
- ``remember_hints``: viser evaluates the type hints of a control's properties anew for every control, which
is a seventh of the time in which a session's panels are built.
- ``call_in_order``: viser handles a browser's messages on any of 32 threads, so that on busy cores a click on
*Reset* can be handled before the choice that it should undo.
- ``replace_data``: viser sends the bytes and arrays of a message inside it, encoded anew for each browser.
- ``listen``: viser gives every message of a browser to its handlers and has no hook before them.
- ``on_opened``, ``on_closed``: viser reports a browser with its first view only, and not the end of a
connection that sent none.
- ``find_control``, ``find_command``, ``find_node``, ``is_live``, ``awaits_render``: the target of a message,
and whether a user could reach it.
- ``send_value``: the control of a browser whose change was refused shows the server's value again.
- ``contents``: the controls in a folder, so that they can be found by typing.
- ``address_of``, ``close``, ``cookies``, ``languages``: parts of a browser's connection.
"""

from __future__ import annotations

import asyncio
import dataclasses
import functools
from collections.abc import Awaitable, Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextvars import ContextVar
from typing import Any, TypeAlias, get_type_hints

import numpy as np
import viser
from viser import _messages as messages
from viser._assignable_props_api import AssignablePropsBase
from viser.infra import _messages as infra_messages

Listener: TypeAlias = Callable[[int, Any, Callable[[], Awaitable[None]]], Awaitable[None]]
"""Takes the browser's number, its message, and a function that lets viser handle the message."""
TRY_AGAIN = 1013
"""Websocket close code after which a page tries again to connect."""


class AnyThreadEvent(asyncio.Event):
    """An event that other threads may set too; the loop's own call, which follows, wakes the waiters."""

    def set(self) -> None:
        """Set the event; on the event loop, also wake the waiters, even if it is set already."""
        self._value = True
        if _on_loop():
            for waiter in self._waiters:
                if not waiter.done():
                    waiter.set_result(True)


def queue_from_any_thread(server: viser.ViserServer) -> None:
    """Make it safe to queue messages on any thread: to all browsers, and to each one that connects later."""

    def queue_to(connection: Any) -> None:
        connection.get_message_buffer().message_event.__class__ = AnyThreadEvent

    queue_to(server._websock_server)
    server._websock_server.on_client_connect(queue_to)


def call_in_order(target: viser.ViserServer | viser.ClientHandle) -> None:
    """Call the callbacks of a browser's controls and scene nodes one after the other, as messages come."""
    in_order = ThreadPoolExecutor(1, thread_name_prefix="callbacks")
    for owner in (target.gui, target.scene):
        setattr(owner, "_thread_executor", in_order)  # noqa: B010


def remember_hints() -> None:
    """Evaluate the type hints of a kind of control or scene node once, not for each of them."""
    hints_of = functools.cache(get_type_hints)
    hints = property(lambda handle: hints_of(type(handle._impl.props)))  # type: ignore[arg-type]
    setattr(AssignablePropsBase, "_prop_hints", hints)  # noqa: B010


def replace_data(server: viser.ViserServer, replacement: Callable[[int, Any, bool], object | None]) -> None:
    """Send what ``replacement(number, data, of_new)`` returns in place of bytes and arrays to a browser.

    None leaves the data as they are. ``of_new`` is whether the message adds a node or a control. Viser starts
    a browser's senders after its callbacks for connections, in the same context; so they know the browser.
    """
    server._websock_server.on_client_connect(
        lambda connection: _replacement.set(functools.partial(replacement, connection.client_id))
    )
    if infra_messages._prepare_for_serialization is not _prepared:
        setattr(infra_messages, "_prepare_for_serialization", _prepared)  # noqa: B010


_replacement = ContextVar[Callable[[Any, bool], object | None] | None]("replacement", default=None)
_of_new = ContextVar[bool | None]("of_new", default=None)
"""Whether what is prepared belongs to something new; None outside the properties of nodes and controls."""
_prepare = infra_messages._prepare_for_serialization


def _prepared(value: Any, annotation: object, binary_buffers: list[memoryview] | None = None) -> Any:
    """Prepare a value of a message for sending, as viser does, with its data replaced."""
    replace = _replacement.get()
    if replace is None or binary_buffers is None:
        return _prepare(value, annotation, binary_buffers)
    of_new = _of_new.get()
    if isinstance(value, bytes | np.ndarray):
        replaced = None if of_new is None else replace(value, of_new)  # parts of files are sent as they are
        return _prepare(value, annotation, binary_buffers) if replaced is None else replaced
    new = dataclasses.is_dataclass(
        value
    )  # only messages that add something have their properties in a record
    if of_new is not None or not (new or isinstance(value, dict)):
        return _prepare(value, annotation, binary_buffers)
    token = _of_new.set(new)
    try:
        return _prepare(value, annotation, binary_buffers)
    finally:
        _of_new.reset(token)


def _on_loop() -> bool:
    try:
        asyncio.get_running_loop()
    except RuntimeError:
        return False
    return True


def listen(server: viser.ViserServer, listener: Listener) -> None:
    """Pass every message from browsers once through a listener, on the thread of the connections.

    Viser gives each message to the shared handlers and to the browser's own; the listener decides for both.
    """
    shared = server._websock_server._handle_incoming_message
    own: dict[int, Callable[[int, Any], Awaitable[None]]] = {}

    async def on_message(number: Any, message: Any) -> None:
        async def go_on() -> None:
            await shared(number, message)
            if number in own:
                await own[number](number, message)

        await listener(number, message, go_on)

    async def ignore(number: Any, message: Any) -> None:
        """Do nothing: ``on_message`` calls this browser's own handler too."""

    def connected(connection: Any) -> None:
        own[connection.client_id] = connection._handle_incoming_message
        setattr(connection, "_handle_incoming_message", ignore)  # noqa: B010

    setattr(server._websock_server, "_handle_incoming_message", on_message)  # noqa: B010
    server._websock_server.on_client_connect(connected)
    server._websock_server.on_client_disconnect(lambda connection: own.pop(connection.client_id, None))


def on_opened(server: viser.ViserServer, call: Callable[[int], object]) -> None:
    """Call a function on the thread of the connections with the number of each connection that opens."""
    server._websock_server.on_client_connect(lambda connection: call(connection.client_id))


def on_closed(server: viser.ViserServer, call: Callable[[int], object]) -> None:
    """Call a function on the thread of the connections with the number of each connection that has closed."""
    server._websock_server.on_client_disconnect(lambda connection: call(connection.client_id))


def find_control(server: viser.ViserServer, number: int, uuid: str) -> tuple[Any, bool] | None:
    """Return the browser's control with this uuid and whether it is shared; None if there is none."""
    for gui, shared in _guis(server, number):
        handle = gui._gui_input_handle_from_uuid.get(uuid)
        if handle is not None:
            return handle, shared
    return None


def find_command(server: viser.ViserServer, number: int, uuid: str) -> tuple[Any, bool] | None:
    """Return the browser's command with this uuid and whether it is shared; None if there is none."""
    for gui, shared in _guis(server, number):
        handle = gui._command_handle_from_uuid.get(uuid)
        if handle is not None:
            return handle, shared
    return None


def find_node(server: viser.ViserServer, number: int, name: str, owner: str) -> tuple[Any, bool] | None:
    """Return the scene node with this name and whether it is shared; None if there is none.

    Args:
        server: the server of the browser.
        number: number of the browser.
        name: name of the node.
        owner: owner as the browser reports it: empty for shared nodes.
    """
    client = server._connected_clients.get(number)
    scene = server.scene if owner == "" else None if client is None else client.scene
    if scene is None or scene._owner_id != owner:
        return None
    handle = scene._handle_from_node_name.get(name)
    return None if handle is None else (handle, owner == "")


def is_live(handle: Any) -> bool:
    """Whether a control exists, is enabled, and is visible with all its containers."""
    if handle._impl.removed or not handle.visible or handle.disabled:
        return False
    gui, container = handle._impl.gui_api, handle._impl.parent_container_id
    while container != "root":
        try:
            within = gui._resolve_container_handle(container)
        except KeyError:  # a closed dialog, or a removed folder
            return False
        if hasattr(within, "_parent"):  # for a tab, its tab group counts
            within = within._parent
        if not getattr(within, "visible", True):
            return False
        if not isinstance(within, viser.GuiFolderHandle | viser.GuiTabGroupHandle):
            return True  # a dialog or a panel has no container
        container = within._impl.parent_container_id
    return True


def contents(container: Any, titles: tuple[str, ...] = ()) -> Iterator[tuple[Any, tuple[str, ...]]]:
    """Yield each visible control and folder in a container, also those in folders and tabs inside it.

    Each comes with ``titles`` and the titles of the folders and tabs between the container and it.
    """
    for child in list(container._children.values()):
        if not getattr(child, "visible", True):
            continue
        yield child, titles
        if isinstance(child, viser.GuiFolderHandle):
            yield from contents(child, (*titles, child.label) if child.label else titles)
        elif isinstance(child, viser.GuiTabGroupHandle):
            for tab in child._tab_handles:
                yield from contents(tab, (*titles, tab._label))


def awaits_render(server: viser.ViserServer, number: int) -> bool:
    """Whether the server waits for a picture from a browser."""
    client = server._connected_clients.get(number)
    handlers = {} if client is None else client._websock_connection._incoming_handlers
    return bool(handlers.get(messages.GetRenderResponseMessage))


def send_value(server: viser.ViserServer, number: int, handle: Any) -> None:
    """Send a browser the server's value of a control, in place of a value that was refused."""
    client = server._connected_clients.get(number)
    if client is not None and not handle._impl.is_button:
        back = messages.GuiUpdateMessage(handle._impl.uuid, {"value": handle._impl.value})
        client._websock_connection.queue_message(back)


def cookies(server: viser.ViserServer, number: int) -> str:
    """Return the cookies of a browser's connection request; empty if it is gone."""
    connection = server._websock_server._live_connections.get(number)
    request = None if connection is None else connection.request
    return "" if request is None else ", ".join(request.headers.get_all("Cookie"))


def languages(server: viser.ViserServer, number: int) -> str:
    """Return the languages that a browser prefers, as its request names them; empty if it names none."""
    connection = server._websock_server._live_connections.get(number)
    request = None if connection is None else connection.request
    return "" if request is None else ", ".join(request.headers.get_all("Accept-Language"))


def address_of(server: viser.ViserServer, number: int) -> str:
    """Return the network address of a browser; empty if it is gone."""
    connection = server._websock_server._live_connections.get(number)
    return "" if connection is None else str((connection.remote_address or ("",))[0])


def close(server: viser.ViserServer, number: int, code: int, reason: str) -> None:
    """Close a browser's connection; may be called on any thread."""
    connection = server._websock_server._live_connections.get(number)
    loop = server._websock_server._background_event_loop
    if connection is not None and loop is not None and not loop.is_closed():
        asyncio.run_coroutine_threadsafe(connection.close(code, reason), loop)


def _guis(server: viser.ViserServer, number: int) -> list[tuple[Any, bool]]:
    """Return the browser's own panel and the shared one, each with whether it is shared."""
    client = server._connected_clients.get(number)
    own = [] if client is None else [(client.gui, False)]
    return [*own, (server.gui, True)]
