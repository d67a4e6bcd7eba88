"""The steps of the app, in their order."""

from app.panel import Panel
from app.screens.depth import DepthPanel
from app.screens.export.panel import ExportPanel
from app.screens.fuse import FusePanel
from app.screens.network import NetworkPanel
from app.screens.scene.panel import ScenePanel
from app.screens.surface import SurfacePanel

PANELS: tuple[type[Panel], ...] = (
    ScenePanel,
    DepthPanel,
    FusePanel,
    SurfacePanel,
    NetworkPanel,
    ExportPanel,
)
