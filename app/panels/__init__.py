"""The steps of the app, in their order."""

from app.panel import Panel
from app.panels.depth import DepthPanel
from app.panels.export import ExportPanel
from app.panels.fuse import FusePanel
from app.panels.network import NetworkPanel
from app.panels.scene import ScenePanel
from app.panels.surface import SurfacePanel

PANELS: tuple[type[Panel], ...] = (
    ScenePanel,
    DepthPanel,
    FusePanel,
    SurfacePanel,
    NetworkPanel,
    ExportPanel,
)
