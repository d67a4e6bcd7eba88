"""Frozen config dataclasses, one per stage: source of the command line, sliders, presets and records."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Literal

from packetmesh.errors import InputError

Pattern = Literal["circles", "circles-asymmetric", "chessboard", "charuco", "aprilgrid"]
"""Pattern that is printed on a calibration board."""
Lens = Literal["thesis", "brown", "rational", "fisheye"]
"""Distortion model: k1, k2 (thesis, SPEC 1.1); also p1, p2, k3 (brown); also k4 to k6 (rational); or k1 to k4
of a fisheye lens."""
OutlierMode = Literal["thesis", "depth_normalised", "robust", "flying"]
AlignmentMode = Literal["none", "median", "affine_depth", "affine_inverse", "local"]
ModelKind = Literal["metric", "relative", "inverse"]
NetworkPreset = Literal[
    "packetmesh", "midas-small", "depth-anything-v2-small", "depth-anything-v2-metric", "monodepth2"
]
Normalisation = Literal["imagenet", "unit", "bytes"]
METHODS = {
    "icp": "icp.Icp",
    "trimmed-icp": "icp.TrimmedIcp",
    "picp": "picp.Picp",
    "ricp": "ricp.Ricp",
    "mricp": "mricp.Mricp",
    "ficp": "ficp.Ficp",
    "hicp": "hicp.Hicp",
    "ceicp-literal": "ceicp_literal.CeicpLiteral",
    "ceicp-n": "ceicp.CeicpN",
    "ceicp-a": "ceicp.CeicpA",
    "ceicp-r": "ceicp.CeicpR",
    "ceicp-ml": "ceicp_ml.CeicpMl",
    "kernel-correlation": "kernel_correlation.KernelCorrelation",
    "fast-robust-icp": "fast_robust.FastRobustIcp",
}
"""Every registration method by name, and its class below ``pipeline.registration``: a new method is a file
with such a class and a line here. The classes are not imported, so that reading settings stays fast."""
if TYPE_CHECKING:
    Method = str
else:
    Method = Literal[tuple(METHODS)]
Metric = Literal["point", "plane"]
Baseline = Literal["poisson", "alpha"]
"""Another method that makes a surface of the same points, for comparison."""
Direction = Literal["q2p", "p2q", "both"]
FusionMode = Literal["union", "fill"]
Fill = Literal["auto", "completion", "network"]
RadiusRule = Literal["thesis", "thesis+", "manual"]
NodePoints = Literal["sensor", "fused"]
MOST_AVERAGED = 64
"""Largest number of depth images that are averaged if the camera stands: 79 MB at 640 x 480 pixels."""


def _at_least(key: str, value: float, least: float) -> None:
    if value < least:
        raise InputError(f"{key} is {value}; try at least {least}")


def _above(key: str, value: float, bound: float) -> None:
    if not value > bound:
        raise InputError(f"{key} is {value}; try a value above {bound}")


@dataclass(frozen=True, slots=True)
class RecordingConfig:
    """Settings that turn a recording into a rig (SPEC 10)."""

    frames: int = MOST_AVERAGED
    """Frames of a camera that stands, from the first one, that are averaged, 1 to 64; recordings of a camera
    that walks and other images do not use it."""

    def __post_init__(self) -> None:
        if not 1 <= self.frames <= MOST_AVERAGED:
            raise InputError(f"recording.frames is {self.frames}; try a number from 1 to {MOST_AVERAGED}")


@dataclass(frozen=True, slots=True)
class AcquisitionConfig:
    """Depth image to filtered point cloud (SPEC 2)."""

    outlier_mode: OutlierMode = "flying"
    """flying removes points between two surfaces or alone, by the sensor's noise. Others compare a point's
    mean neighbour distance with mu + t sigma of the cloud (thesis), with the same after division by depth
    (depth_normalised), or after that division with median + 3 robust sigma (robust)."""
    outlier_neighbours: int = 4
    """Neighbours N over which the mean distance is taken (eq. 3.5); the flying mode does not use it."""
    outlier_t: float = 1.0
    """Threshold t in sigmas (eq. 3.6); the robust and the flying mode do not use it."""
    average: bool = True
    """Average measured depth over its surface, within the sensor's noise."""

    def __post_init__(self) -> None:
        _at_least("acquisition.outlier_neighbours", self.outlier_neighbours, 1)


@dataclass(frozen=True, slots=True)
class DepthConfig:
    """RGB image to metric depth (SPEC 3)."""

    model: str | None = None
    """ONNX file of the depth network; None uses the network that comes with PacketMesh."""
    preset: NetworkPreset | None = None
    """Input and output convention of that network; None reads it from the file."""
    model_kind: ModelKind | None = None
    """Output of the network: metres, depth up to scale, or disparity up to scale and shift; None takes the
    value of the preset or the file."""
    input_width_px: int | None = None
    """Width of the network's input images, if its file does not fix it; None takes the value of the preset
    or the file."""
    input_height_px: int | None = None
    """Height of the network's input images; set both or neither."""
    normalisation: Normalisation | None = None
    """Scaling of the network's input: by ImageNet's mean and deviation, from 0 to 1 (unit) or to 255 (bytes);
    None takes the value of the preset or the file."""
    completion: str | None = None
    """ONNX file of the network that completes measured depth from image and depth; None uses the network that
    comes with PacketMesh."""
    completion_normalisation: Normalisation | None = None
    """Scaling of that network's image, as ``normalisation``; None takes it from the file, or else unit."""
    crop: bool = False
    """Infer on the thesis's 304 x 228 centre crop instead of the whole image."""
    alignment: AlignmentMode = "local"
    """Alignment that makes inferred depth metric by the sensor's (SPEC 3.5)."""
    fill: Fill = "auto"
    """Depth for the sensor's holes: completed from colours and measured depth together (completion), or the
    colour network's aligned depth (network); auto is network if a model is named and no completion, else
    completion."""
    reach: float = 0.1
    """Largest distance of inferred depth from measured pixels, as a share of the image's diagonal."""
    least_confidence: float = 0.5
    """Least confidence, 0 to 1, of inferred depth that is used: depth more likely wrong than right forms
    skirts from objects to the surfaces behind them (``python -m lab.training.least_confidence``)."""

    def of_network(self) -> DepthConfig:
        """Return the config with only the network's own settings, on which its inference depends."""
        plain = DepthConfig()
        return replace(
            self,
            alignment=plain.alignment,
            fill=plain.fill,
            reach=plain.reach,
            least_confidence=plain.least_confidence,
            completion=None,
            completion_normalisation=None,
        )

    @property
    def completes(self) -> bool:
        """Whether completion fills the sensor's holes."""
        by_default = self.model is None or self.completion is not None
        return self.fill == "completion" or (self.fill == "auto" and by_default)

    def __post_init__(self) -> None:
        _above("depth.reach", self.reach, 0.0)
        if (self.input_width_px is None) != (self.input_height_px is None):
            raise InputError(
                "Of depth.input_width_px and depth.input_height_px only one is set, to "
                f"{self.input_width_px or self.input_height_px}; try both, or none"
            )
        for key, side_px in (("width", self.input_width_px), ("height", self.input_height_px)):
            if side_px is not None:
                _at_least(f"depth.input_{key}_px", side_px, 1)
        if not 0.0 <= self.least_confidence <= 1.0:
            raise InputError(
                f"depth.least_confidence is {self.least_confidence}; try a value between 0 and 1"
            )


@dataclass(frozen=True, slots=True)
class RegistrationConfig:
    """Iterative closest points, plain or weighted by information (SPEC 4)."""

    method: Method = "ceicp-a"
    metric: Metric = "plane"
    """Residual that is minimised: point to point, or point to the target's tangent plane."""
    direction: Direction = "q2p"
    """q2p: each source point finds a target point; p2q: the reverse; both: their union."""
    with_scale: bool = False
    """Estimate a similarity instead of a rigid motion (point metric only)."""
    gate_m: float = 0.3
    """Largest pair distance T_d of CEICP; the shift at which every method stops is in proportion to it."""
    sigma_min_m: float | None = None
    """Smallest weight scale of CEICP-A and CEICP-R; None takes the largest of 0.6 times the target's median
    spacing, its median depth noise, and a thousandth of the gate."""
    sigma_decay: float = 0.85
    """Factor rho by which CEICP-A's scale shrinks in each iteration."""
    trim: float = 0.9
    """Share of the closest pairs that trimmed-icp and hicp keep."""
    unit: Literal["mm", "m"] = "mm"
    """Unit in which ceicp-literal measures; its weights depend on it."""
    hue_weight_m: float = 0.3
    """Radius of the circle on which hicp places hues as extra coordinates; opposite ones are 2 radii away."""
    max_iterations: int = 100
    max_points: int = 10_000
    """Points drawn from each cloud for matching."""
    seed: int = 0
    start: Literal["given", "global"] = "given"
    """given: start from the given poses; global: from a pose found by matching features first."""

    def __post_init__(self) -> None:
        if self.method not in METHODS:
            raise InputError(f"registration.method is {self.method}; try one of {', '.join(METHODS)}")
        _above("registration.gate_m", self.gate_m, 0.0)
        _at_least("registration.max_iterations", self.max_iterations, 1)
        _at_least("registration.max_points", self.max_points, 6)
        if not 0.0 < self.sigma_decay < 1.0:
            raise InputError(
                f"registration.sigma_decay is {self.sigma_decay}; try a value between 0.5 and 0.95"
            )
        if not 0.0 < self.trim <= 1.0:
            raise InputError(f"registration.trim is {self.trim}; try a share between 0.5 and 1")
        _at_least("registration.hue_weight_m", self.hue_weight_m, 0.0)
        if self.sigma_min_m is not None:
            _above("registration.sigma_min_m", self.sigma_min_m, 0.0)
        if self.with_scale and self.metric == "plane":
            raise InputError("registration.with_scale needs the point metric; try metric=point")


@dataclass(frozen=True, slots=True)
class FusionConfig:
    """Fusion of two clouds to one (SPEC 4.9)."""

    mode: FusionMode = "fill"
    """union: all points of both; fill: inferred points only where the sensor has none."""
    align_nodes_with: NodePoints = "sensor"
    """Points by which nodes are registered to one another."""
    register_inferred: bool = False
    """Move each node's inferred cloud rigidly onto its sensor cloud, as the thesis does; without it the
    cloud keeps the depth stage's pixel-wise alignment, which is more accurate (SPEC 3.5)."""


@dataclass(frozen=True, slots=True)
class SurfaceConfig:
    """Ball pivoting (SPEC 5)."""

    radius_rule: RadiusRule = "thesis+"
    """thesis: r_F + {0, 1/4, 1/2, 1} sigma_D; thesis+: r_F + {0, 1, 2, 4} sigma_D; manual."""
    radii_m: tuple[float, ...] = ()
    """Ball radii of the manual rule."""
    max_points: int = 50_000
    """The clouds are averaged over voxels that leave about this many points, or fewer if such voxels would
    be smaller than twice the sensors' noise."""
    smoothing_passes: int = 2
    """Times that every averaged point is moved onto the plane of its neighbours; 0 keeps the noise."""
    even_rims: bool = True
    """Close notches of the rims, drop spikes, and smooth the rims' curves within the sensors' noise."""

    def __post_init__(self) -> None:
        _at_least("surface.max_points", self.max_points, 3)
        _at_least("surface.smoothing_passes", self.smoothing_passes, 0)
        for radius_m in self.radii_m:
            _above("surface.radii_m", radius_m, 0.0)
        if self.radius_rule == "manual" and not self.radii_m:
            raise InputError(
                "surface.radius_rule is manual but surface.radii_m is empty; try radii_m=0.02,0.04"
            )


@dataclass(frozen=True, slots=True)
class PipelineConfig:
    """All settings of the reconstruction."""

    acquisition: AcquisitionConfig = field(default_factory=AcquisitionConfig)
    depth: DepthConfig = field(default_factory=DepthConfig)
    inferred_registration: RegistrationConfig = field(default_factory=RegistrationConfig)
    """Registers the inferred cloud to the sensor cloud of a node, if ``fusion.register_inferred``."""
    node_registration: RegistrationConfig = field(default_factory=RegistrationConfig)
    """Registers nodes to one another."""
    fusion: FusionConfig = field(default_factory=FusionConfig)
    surface: SurfaceConfig = field(default_factory=SurfaceConfig)
    recording: RecordingConfig = field(default_factory=RecordingConfig)


PRESETS: dict[str, PipelineConfig] = {
    "packetmesh": PipelineConfig(),
    "thesis": PipelineConfig(
        acquisition=AcquisitionConfig(outlier_mode="thesis", average=False),
        depth=DepthConfig(crop=True, alignment="median", fill="network", least_confidence=0.0),
        inferred_registration=RegistrationConfig(method="ceicp-n", metric="point"),
        node_registration=RegistrationConfig(method="ceicp-n", metric="point"),
        fusion=FusionConfig(mode="union", align_nodes_with="fused", register_inferred=True),
        surface=SurfaceConfig(radius_rule="thesis", max_points=30_000, smoothing_passes=0, even_rims=False),
    ),
}
"""Settings by name: ours (the default) and those of the thesis."""
