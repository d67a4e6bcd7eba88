"""Jobs by name: all of them, in folders of screens too, are imported before anybody asks."""

import importlib
from types import SimpleNamespace

from app.compute import jobs
from tests.paths import ROOT


def test_a_process_warms_up_with_every_job_of_every_screen(monkeypatch):
    imported, real = [], importlib.import_module

    def note(name):
        imported.append(name)
        return real(name) if name == jobs.SCREENS else SimpleNamespace(warm_up=lambda: iter(()))

    monkeypatch.setattr(jobs.importlib, "import_module", note)
    assert len(list(jobs.warm_up())) > 10
    files = (ROOT / "app" / "screens").rglob("*job.py")
    names = {".".join(path.relative_to(ROOT).with_suffix("").parts) for path in files}
    assert "app.screens.network.planning.plan_job" in names
    assert names <= set(imported)
