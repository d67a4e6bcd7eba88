"""A control panel without a browser, and a hand and an eye that know its controls by their labels."""

from __future__ import annotations

import contextlib
import html
import inspect
import json
import re
from dataclasses import replace
from types import SimpleNamespace

import viser

from app.compute import jobs
from app.compute.state import CHAIN, Results, Spec
from app.window.gui import Gui as PanelGui
from app.window.ui import Ui
from packetmesh.errors import PacketMeshError
from packetmesh.progress import drain as end
from pipeline.sources import Demo


class Handle:
    """A control, a text, a picture or a folder, with the properties of viser's."""

    def __init__(self, gui, kind, arguments, folders):
        self.gui, self.kind, self.folders, self.callbacks = gui, kind, folders, []
        self.visible = True
        for name, value in arguments.items():
            setattr(self, "value" if name == "initial_value" else name, value)
        if kind in ("add_dropdown", "add_button_group"):
            self.options = tuple(self.options)

    def __setattr__(self, name, value):
        if name == "value" and getattr(self, "value", None) is not None:
            value = type(self.value)(value)
        super().__setattr__(name, tuple(value) if name == "options" else value)
        if name == "options" and getattr(self, "value", None) not in self.options:
            super().__setattr__("value", self.options[0])

    def __enter__(self):
        self.gui.open.append(self)
        return self

    def __exit__(self, *_):
        self.gui.open.pop()

    def on_update(self, callback):
        self.callbacks.append(callback)

    on_click = on_upload = on_trigger = on_update

    def add_tab(self, label):
        return Handle(self.gui, "add_tab", {"label": label}, tuple(self.gui.open))

    def close(self):
        self.visible = False

    def float(self, **place):
        """A panel of its own, somewhere."""

    def expand(self):
        """It is open."""

    @property
    def seen(self):
        """Whether it and all that it lies in are visible."""
        return self.visible and all(folder.visible for folder in self.folders)


class Gui:
    """Keeps whatever is added, in order."""

    def __init__(self):
        self.handles, self.open = [], []

    def __getattr__(self, name):
        if not name.startswith("add_"):
            raise AttributeError(name)
        signature = inspect.signature(getattr(viser.GuiApi, name))

        def add(*arguments, **keywords):
            bound = signature.bind(self, *arguments, **keywords)
            bound.apply_defaults()
            del bound.arguments["self"]
            handle = Handle(self, name, bound.arguments, tuple(self.open))
            self.handles.append(handle)
            return handle

        return add

    def find(self, label, folder=None):
        """The control with this label, in a folder or in none of several that have one."""
        found = [one for one in self._in(folder) if getattr(one, "label", None) == label]
        if len(found) > 1 and folder is None:
            found = [one for one in found if not one.folders] or found
        assert len(found) == 1, f"{len(found)} controls are called {label!r}"
        return found[0]

    def find_starting(self, label):
        """The one control whose label begins so."""
        (found,) = (one for one in self.handles if str(getattr(one, "label", "")).startswith(label))
        return found

    def set(self, label, value, folder=None):
        """Change an input as a person does."""
        handle = self.find(label, folder)
        assert "options" not in vars(handle) or value in handle.options, (value, handle.options)
        handle.value = value
        self._fire(handle, handle)

    def press(self, label, button=None, folder=None):
        """Press a button, or one of a group."""
        handle = self.find(label, folder)
        assert button is None or button in handle.options
        self._fire(handle, SimpleNamespace(value=button))

    def upload(self, label, name, content=b"onnx"):
        """Choose a file behind an upload button."""
        self._fire(self.find(label), SimpleNamespace(value=SimpleNamespace(name=name, content=content)))

    def _fire(self, handle, target):
        for callback in handle.callbacks:
            callback(SimpleNamespace(client=SimpleNamespace(), target=target))

    def text(self, folder=None):
        """Everything that can be read, line by line."""
        texts = [one for one in self._in(folder) if one.kind in ("add_markdown", "add_html")]
        return "\n".join(one.content for one in texts if one.seen and one.content)

    def all(self, kind, folder=None):
        """All of a kind, such as ``plotly`` or ``image``, that can be seen."""
        return [one for one in self._in(folder) if one.kind == f"add_{kind}" and one.seen]

    def _in(self, folder):
        return [one for one in self.handles if folder is None or folder in [f.label for f in one.folders]]


class Scene:
    """A viser scene that knows the names in it and can be clicked."""

    def __init__(self, scene):
        self._scene, self._names, self._clicks = scene, [], []

    def __getattr__(self, name):
        found = getattr(self._scene, name)
        if name.startswith("add_"):

            def add(node, *arguments, **keywords):
                self._names.append(node)
                return found(node, *arguments, **keywords)

            return add
        return found

    def on_click(self):
        return self._clicks.append

    def click(self, origin_m, direction):
        """Click at what a ray meets."""
        for callback in self._clicks:
            callback(SimpleNamespace(ray_origin=tuple(origin_m), ray_direction=tuple(direction)))

    def names(self, below):
        """What is drawn below a node."""
        found = [name for name in self._names if name.startswith(f"{below}/")]
        return [name for name in dict.fromkeys(found) if self._scene.get_handle_by_name(name) is not None]


def at_once(function, *arguments):
    """In place of the session's thread."""
    function(*arguments)


def ui_of(scene=None, post=at_once, kind=Ui):
    """A bundle with a new control panel; the scene is a server's."""
    return kind(PanelGui(Gui()), Scene(scene), post, contextlib.nullcontext, lambda: None)


class Impatient(Ui):
    """Does at once what otherwise waits until a hand rests."""

    def debounce(self, wait_s, action):
        return SimpleNamespace(restart=action, cancel=lambda: None, pending=False)


def page_calls(content):
    """What HTML has the page call, by name and with its arguments."""
    found = re.findall(r'data-packetmesh-call="([^"]+)" data-arguments="([^"]*)"', content)
    return [(name, json.loads(html.unescape(arguments))) for name, arguments in found]


START = Spec(Demo("box-on-table"))


class Bench:
    """Stands for a session with one panel: computes at once and in this process what the panel asks for."""

    def __init__(self, panel, ui, store, folder=None, steps=CHAIN, spec=START):
        self.ui = ui
        self.store, self.folder, self.steps = store, folder, steps
        self.spec = spec
        self.results, self.notices = Results(), []
        self.refuse = ""
        """Why nothing can be computed now."""
        camera = SimpleNamespace(aspect=1.5, image_height=600, fov=0.9, position=None, look_at=None)
        self.client = SimpleNamespace(client_id=0, camera=camera, atomic=contextlib.nullcontext)
        self.panel = panel(self)
        self.ui.scene.add_frame(panel.drawn_below, show_axes=False)
        self.panel.build()

    @property
    def gui(self):
        return self.ui.gui

    def new_folder(self):
        folder = self.folder / f"upload{len(list(self.folder.iterdir()))}"
        folder.mkdir()
        return folder

    def drawn(self, name):
        """What is drawn by this name, or None."""
        return self.ui.scene.get_handle_by_name(name)

    def clients(self):
        return [self.client]

    def frame_view(self, anew=False):
        self.panel.look()

    def notify(self, title, sentence, color="red"):
        self.notices.append(sentence)

    def edit(self, change):
        self.want(replace(self.spec, config=change(self.spec.config)))

    def want(self, spec):
        self.spec = spec
        self.panel.on_spec(spec)
        self.advance()

    def advance(self):
        while (step := self.results.first_stale(self.spec, self.steps)) is not None:
            key = self.spec.key(step)
            if self.refuse:
                self.results.fail(step, key, self.refuse)
                self.panel.on_failure(step, self.refuse)
            else:
                view = end(jobs.run_step(step, self.store, self.spec))
                self.results.put(step, key, view)
                self.panel.on_view(step, view)

    def side_job(self, job, *arguments, on_end, on_partial=None, key=None):
        view = None
        try:
            if not self.refuse:
                view = end(jobs.run(job, self.store, self.spec, *arguments))
        except PacketMeshError as error:
            self.notices.append(str(error))
        on_end(view)

    quick_job = side_job

    def cancel_side_job(self):
        """Nothing runs beside the test."""
