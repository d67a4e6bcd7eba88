"""PacketMesh for scripts and notebooks: from camera nodes and their packets to a surface mesh.

    import packetmesh as pm

    rig = pm.load_demo("living-room")
    result = pm.reconstruct(rig, pm.PRESETS["packetmesh"])
    pm.write_mesh("room.glb", result.after)

Lengths are in metres, times in seconds and angles in radians, unless a name ends in another unit (``t_ns``,
``rotation_deg``). Each name's module is imported at its first use, so that ``import packetmesh`` does not
import numpy.
"""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from app.notebook.show import Shown, show
    from network_sim.config import (
        EnergyConfig,
        LossConfig,
        MacConfig,
        NetworkConfig,
        NodesConfig,
        RadioConfig,
        RunConfig,
        SchemeConfig,
        StreetConfig,
        UplinkConfig,
    )
    from network_sim.metrics.arrivals import Arrivals, arrivals
    from network_sim.metrics.metrics import Metric, image_delays_s
    from network_sim.metrics.metrics import metrics as network_metrics
    from network_sim.presets import PRESETS as NETWORK_PRESETS
    from network_sim.simulate import iterate_simulation, simulate
    from network_sim.trace.log import Events, NetworkTrace
    from network_sim.types import Cause, EventKind
    from packetmesh.errors import InputError, PacketMeshError, ReconstructionError
    from packetmesh.progress import Progress, drain
    from packetmesh.settings import with_settings
    from pipeline.acquisition import back_project
    from pipeline.calibration.board import Board
    from pipeline.calibration.calls import calibrate, calibrate_cameras
    from pipeline.calibration.from_images import CameraReport
    from pipeline.calibration.rig import RelativePose
    from pipeline.calibration.rig_from_images import RigReport
    from pipeline.config import (
        PRESETS,
        AcquisitionConfig,
        DepthConfig,
        FusionConfig,
        PipelineConfig,
        RegistrationConfig,
        SurfaceConfig,
    )
    from pipeline.deliver import Delivery, deliver
    from pipeline.delivery.moments import Moment
    from pipeline.io.calibrations import CalibratedNode, write_calibration
    from pipeline.io.clouds import read_cloud, write_cloud
    from pipeline.io.demos import DEMO_SCENES, board_views_of, load_demo
    from pipeline.io.meshes import read_mesh, write_mesh
    from pipeline.io.rigs import load_frame, load_rig, save_rig
    from pipeline.measuring.calls import measure
    from pipeline.measuring.surface import MeasuredSurface, measured_cloud, measured_surface, read_measured
    from pipeline.measuring.values import Measure, Value
    from pipeline.planning.calls import RigPlan, plan
    from pipeline.planning.plan import Plan, PlanConfig, PlannedCamera
    from pipeline.planning.promise import Promise
    from pipeline.planning.radio import CameraDelivery, PlanDelivery, PlanRadio
    from pipeline.quality import SurfaceQuality
    from pipeline.reconstruct import Reconstruction, reconstruct
    from pipeline.registration import iterate_registration, point_error_m, register
    from pipeline.surface.ball_pivoting import iterate_ball, roll_ball
    from pipeline.surface.normals import estimate_normals
    from pipeline.surface.pivoting import BallPivotStep
    from pipeline.surface.radii import spacing
    from pipeline.types import (
        CameraIntrinsics,
        DepthMap,
        PointCloud,
        PointSource,
        RegistrationResult,
        RegistrationStep,
        RgbdFrame,
        Rig,
        RigTruth,
        Surface,
        SurfaceResult,
    )

_NAMES = {
    "app.notebook.show": "Shown show",
    "network_sim.metrics.arrivals": "Arrivals arrivals",
    "network_sim.config": (
        "EnergyConfig LossConfig MacConfig NetworkConfig NodesConfig RadioConfig RunConfig SchemeConfig "
        "StreetConfig UplinkConfig"
    ),
    "network_sim.metrics.metrics": "Metric image_delays_s",
    "network_sim.simulate": "iterate_simulation simulate",
    "network_sim.trace.log": "Events NetworkTrace",
    "network_sim.types": "Cause EventKind",
    "packetmesh.errors": "InputError PacketMeshError ReconstructionError",
    "packetmesh.progress": "Progress drain",
    "packetmesh.settings": "with_settings",
    "pipeline.acquisition": "back_project",
    "pipeline.calibration.board": "Board",
    "pipeline.calibration.calls": "calibrate calibrate_cameras",
    "pipeline.calibration.from_images": "CameraReport",
    "pipeline.calibration.rig": "RelativePose",
    "pipeline.calibration.rig_from_images": "RigReport",
    "pipeline.config": (
        "PRESETS AcquisitionConfig DepthConfig FusionConfig PipelineConfig RegistrationConfig SurfaceConfig"
    ),
    "pipeline.deliver": "Delivery deliver",
    "pipeline.delivery.moments": "Moment",
    "pipeline.io.calibrations": "CalibratedNode write_calibration",
    "pipeline.io.clouds": "read_cloud write_cloud",
    "pipeline.io.demos": "DEMO_SCENES board_views_of load_demo",
    "pipeline.io.meshes": "read_mesh write_mesh",
    "pipeline.io.rigs": "load_frame load_rig save_rig",
    "pipeline.measuring.calls": "measure",
    "pipeline.measuring.surface": "MeasuredSurface measured_cloud measured_surface read_measured",
    "pipeline.measuring.values": "Measure Value",
    "pipeline.planning.calls": "RigPlan plan",
    "pipeline.planning.plan": "Plan PlanConfig PlannedCamera",
    "pipeline.planning.promise": "Promise",
    "pipeline.planning.radio": "CameraDelivery PlanDelivery PlanRadio",
    "pipeline.quality": "SurfaceQuality",
    "pipeline.reconstruct": "Reconstruction reconstruct",
    "pipeline.registration": "iterate_registration point_error_m register",
    "pipeline.surface.ball_pivoting": "iterate_ball roll_ball",
    "pipeline.surface.normals": "estimate_normals",
    "pipeline.surface.pivoting": "BallPivotStep",
    "pipeline.surface.radii": "spacing",
    "pipeline.types": (
        "CameraIntrinsics DepthMap PointCloud PointSource RegistrationResult RegistrationStep RgbdFrame "
        "Rig RigTruth Surface SurfaceResult"
    ),
}
_PLACES = {name: (module, name) for module, names in _NAMES.items() for name in names.split()} | {
    "NETWORK_PRESETS": ("network_sim.presets", "PRESETS"),
    "network_metrics": ("network_sim.metrics.metrics", "metrics"),
}
"""Module and attribute of every public name."""

__all__ = [
    "DEMO_SCENES", "NETWORK_PRESETS", "PRESETS", "AcquisitionConfig", "Arrivals", "BallPivotStep", "Board",
    "CalibratedNode", "CameraDelivery", "CameraIntrinsics", "CameraReport", "Cause", "Delivery",
    "DepthConfig", "DepthMap", "EnergyConfig", "EventKind", "Events", "FusionConfig", "InputError",
    "LossConfig", "MacConfig", "Measure", "MeasuredSurface", "Metric", "Moment", "NetworkConfig",
    "NetworkTrace", "NodesConfig", "PacketMeshError", "PipelineConfig", "Plan", "PlanConfig",
    "PlanDelivery", "PlanRadio", "PlannedCamera", "PointCloud", "PointSource", "Progress", "Promise",
    "RadioConfig", "Reconstruction", "ReconstructionError", "RegistrationConfig", "RegistrationResult",
    "RegistrationStep", "RelativePose", "RgbdFrame", "Rig", "RigPlan", "RigReport", "RigTruth", "RunConfig",
    "SchemeConfig", "Shown", "StreetConfig", "Surface", "SurfaceConfig", "SurfaceQuality", "SurfaceResult",
    "UplinkConfig", "Value", "arrivals", "back_project", "board_views_of", "calibrate", "calibrate_cameras",
    "deliver", "drain", "estimate_normals", "image_delays_s", "iterate_ball", "iterate_registration",
    "iterate_simulation", "load_demo", "load_frame", "load_rig", "measure", "measured_cloud",
    "measured_surface", "network_metrics", "plan", "point_error_m", "read_cloud", "read_measured",
    "read_mesh", "reconstruct", "register", "roll_ball", "save_rig", "show", "simulate", "spacing",
    "with_settings", "write_calibration", "write_cloud", "write_mesh",
]  # fmt: skip


def __dir__() -> list[str]:
    return __all__


if not TYPE_CHECKING:  # type checkers would accept every name if they saw this function

    def __getattr__(name: str) -> object:
        if name not in _PLACES:
            raise AttributeError(f"packetmesh has no {name!r}; dir(packetmesh) lists its names")
        module, attribute = _PLACES[name]
        globals()[name] = getattr(import_module(module), attribute)
        return globals()[name]
