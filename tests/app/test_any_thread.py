import asyncio
import threading
from collections import deque

import pytest
import viser

from app.any_thread import AnyThreadEvent, queue_from_any_thread


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


def test_viser_queues_with_it():
    server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    try:
        queue_from_any_thread(server._websock_server)
        assert isinstance(server._websock_server.get_message_buffer().message_event, AnyThreadEvent)
        server.gui.add_markdown("queued")
    finally:
        server.stop()
