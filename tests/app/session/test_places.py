"""What is in the address on each screen, and what an address sets."""

from types import SimpleNamespace

from app.compute.state import Spec
from app.session.address import Place
from app.session.places import Places
from app.window.in_address import CallbackState
from pipeline.sources import Demo


class Text(CallbackState):
    """A part whose state is a text."""

    def __init__(self, text=""):
        kept = [text]
        super().__init__(lambda: kept[0], lambda place: kept.__setitem__(0, place))


def panel(title, always="", **parts):
    return SimpleNamespace(
        title=title,
        drawn_below=f"/{title.lower()}",
        in_address={key: Text(text) for key, text in parts.items()},
        always_in_address={always: Text(f"list of {title}")} if always else {},
    )


def session_of(*panels):
    session = SimpleNamespace(
        panels=panels,
        current=panels[0],
        spec=Spec(Demo("office")),
        target=None,
        ui=SimpleNamespace(resets=[]),
    )
    session.want = lambda spec: setattr(session, "spec", spec)
    session.show = lambda title: setattr(
        session, "current", next(one for one in panels if one.title == title)
    )
    session.notify = lambda title, sentence: None
    return session


def test_the_lists_of_measures_of_all_screens_are_in_the_address_of_each():
    session = session_of(
        panel("Scene", "measure-points", look="a"), panel("Surface", "measure", look="b"), panel("Export")
    )
    places = Places(session, None)
    lists = {"measure-points": "list of Scene", "measure": "list of Surface"}
    for title, own in (("Scene", {"look": "a"}), ("Surface", {"look": "b"}), ("Export", {})):
        session.show(title)
        assert dict(places._now().added) == lists | own
    # A reload on another screen gives each list back to its own screen.
    fresh = session_of(*(panel(one.title, next(iter(one.always_in_address), "")) for one in session.panels))
    for one in fresh.panels:
        for part in one.always_in_address.values():
            part.take("")
    Places(fresh, None)._go_to(Place(fresh.spec, "Export", tuple(lists.items())), [])
    assert fresh.current.title == "Export"
    found = {key: part.place() for one in fresh.panels for key, part in one.always_in_address.items()}
    assert found == lists


def test_a_reset_empties_the_lists_too():
    session = session_of(panel("Scene", "measure-points"), panel("Surface", "measure"))
    Places(session, None).reset()
    assert not any(part.place() for one in session.panels for part in one.always_in_address.values())
