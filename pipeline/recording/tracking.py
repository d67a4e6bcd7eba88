"""Tracking: where the camera was at each frame (SPEC 10.1).

Each frame's depth is registered to the last keyframe's; photographs hold the motions that depth leaves open.
Once a frame shows little of the keyframe, it becomes the next one.
"""

from __future__ import annotations

import time
from collections.abc import Generator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from packetmesh.errors import ReconstructionError
from packetmesh.progress import Progress
from pipeline.config import RegistrationConfig
from pipeline.kernels.geometry import inverse, orthonormal, rigid, rotation_angle_rad, rotation_exp
from pipeline.recording.brightness import Brightness
from pipeline.recording.checkpoint import EVERY_S, Checkpoint, State
from pipeline.recording.clouds import KeyframeClouds
from pipeline.recording.recording import Recording, read_ahead
from pipeline.registration.graph.edges import registration_information, small_motion
from pipeline.registration.organised import (
    OrganisedCloud,
    organised,
    register_organised,
    shared_shares,
)
from pipeline.registration.photometric import open_motions
from pipeline.types import FloatArray, Link

GATE_M = 0.15
"""Largest distance of a pair, at the start pose."""
NEW_BELOW = 0.8
"""Overlap with the keyframe below which a frame becomes the next keyframe."""
LEAST_OVERLAP, LEAST_AGREEMENT = 0.3, 0.9
"""Overlap and agreement of a pose that is believed: right ones agree in .99 of what both measured, wrong ones
in .77 to .87 (rendered walks in three rooms, with jumps)."""
LESS_AGREEMENT, STEP_M, STEP_DEG = 0.7, 0.03, 2.0
"""Agreement that is enough within these distances of the predicted pose: people who walk by lower it."""
PREDICTED_M, PREDICTED_RAD = 0.02, np.radians(1.5)
"""Standard error of a predicted pose."""
GIVEN_INFORMATION = np.diag([0.05**-2.0] * 3 + [0.1**-2.0] * 3)
"""Information of a given pose across frames that show nothing: .05 rad and 10 cm."""
WITHIN = 0.03
"""Largest difference of depths that agree, as a share."""
LEAST_POINTS = 300
"""A frame with fewer points cannot be tracked."""
TRIED_KEYFRAMES = 4
"""Most keyframes that a frame is compared with when the camera is lost."""
PATIENCE = 5
"""After this many frames without a pose, the next one begins a new part of the recording."""
REPORTED = 10
"""Frames from one report of progress to the next."""
TRACKING = RegistrationConfig("ceicp-a", "plane", gate_m=GATE_M)


@dataclass(frozen=True, slots=True)
class Tracked:
    """A frame's pose relative to a keyframe."""

    keyframe: int
    """Frame number of its keyframe; for a keyframe its own."""
    T_keyframe_frame: FloatArray
    """(4, 4) pose of the depth camera in the keyframe's."""


@dataclass(frozen=True, slots=True)
class Track:
    """Result of tracking, before loops are closed."""

    frames: tuple[Tracked | None, ...]
    """One for each frame; None where the camera was lost."""
    clouds: Mapping[int, OrganisedCloud]
    """The keyframes' points by frame number, in order of time."""
    links: tuple[Link, ...]
    """Registrations of each keyframe to an earlier one."""
    blind: tuple[int, ...] = ()
    """Frames with fewer than ``LEAST_POINTS`` points."""
    disturbed: tuple[int, ...] = ()
    """Frames with a pose that agree with their keyframe in less than ``LEAST_AGREEMENT``: something moved."""


@dataclass(frozen=True, slots=True)
class Registered:
    """Registration of a frame to a keyframe, with its checks."""

    T_target_source: FloatArray
    """(4, 4)."""
    information: FloatArray
    """(6, 6) as in ``PoseEdge``."""
    overlap_share: float
    """Share of the source's points that the target's image judges."""
    agreeing_share: float
    """Share of the judged points whose depths agree; the smaller of source to target and back."""

    @property
    def may_hold(self) -> bool:
        """Whether the check is enough for a pose that has other evidence."""
        return self.overlap_share >= LEAST_OVERLAP and self.agreeing_share >= LESS_AGREEMENT

    @property
    def holds(self) -> bool:
        """Whether source and target show the same place at this pose."""
        return self.overlap_share >= LEAST_OVERLAP and self.agreeing_share >= LEAST_AGREEMENT

    def holds_near(self, T_predicted: FloatArray) -> bool:
        """Whether it holds, or agrees by ``LESS_AGREEMENT`` near the predicted pose."""
        T = inverse(T_predicted) @ self.T_target_source
        near = np.linalg.norm(T[:3, 3]) <= STEP_M
        near &= np.degrees(rotation_angle_rad(T[:3, :3])) <= STEP_DEG
        return self.holds or (bool(near) and self.may_hold)


def iterate_tracking(
    recording: Recording,
    T_world_camera: Sequence[FloatArray | None] | None = None,
    checkpoint: Checkpoint | None = None,
) -> Generator[Progress, None, Track]:
    """Find the pose of every frame relative to its keyframe.

    The start pose follows from the last motion, or from that of given poses. A frame that does not register
    to its keyframe is tried against the last ones; until one fits, frames have no pose. If none fits for
    ``PATIENCE`` frames, a new part begins, which tracking joins to the part before by given poses only.

    Args:
        recording: the frames.
        T_world_camera: (4, 4) given pose of the colour camera at each frame, None where it is unknown; None
            without any.
        checkpoint: where the state is written every ``EVERY_S``, and read in the beginning.
    """
    count, given = len(recording.times_s), list[FloatArray | None]()
    if T_world_camera is not None:
        T_color_depth = recording.view(0).T_color_depth
        given = [None if T is None else T @ T_color_depth for T in T_world_camera]
    tracker, first = _Tracker(given, Brightness(recording)), 0
    if checkpoint is not None and (state := checkpoint.read()) is not None:
        yield from tracker.iterate_restoring(recording, state)
        first = len(tracker.track().frames)
    written_s = time.monotonic()
    for k, view in read_ahead(recording, range(first, count)):
        if k % REPORTED == 0:
            yield Progress(f"frame {k} of {count}", k / count)
        tracker.follow(k, organised(view.depth, view.camera))
        if checkpoint is not None and time.monotonic() - written_s >= EVERY_S:
            checkpoint.write(tracker.state())
            written_s = time.monotonic()
    if checkpoint is not None and first < count and checkpoint.path.exists():
        checkpoint.write(tracker.state())
    return tracker.track()


class _Tracker:
    """State of tracking: the keyframe, the pose in it, and the last motion."""

    def __init__(self, given: Sequence[FloatArray | None], brightness: Brightness) -> None:
        """Start without frames; ``given`` has the depth camera's pose at each frame or None, or is empty."""
        self._given, self._brightness = given, brightness
        self._clouds = KeyframeClouds()
        self._frames: list[Tracked | None] = []
        self._links: list[Link] = []
        self._blind: list[int] = []
        self._disturbed: list[int] = []
        self._keyframe = -1
        self._pose: FloatArray = np.eye(4)
        """Pose of the last tracked frame in its keyframe."""
        self._motion: FloatArray = np.eye(4)
        """Pose of the last tracked frame in the frame before it; the identity if that one was not tracked."""
        self._last = -1
        """Number of the last tracked frame."""

    def follow(self, k: int, cloud: OrganisedCloud) -> None:
        """Track the next frame."""
        if len(cloud) < LEAST_POINTS:
            self._blind.append(k)
            self._frames.append(None)
            return
        if self._keyframe < 0:
            self._begin(k, cloud)
            return
        start, follows = self._predicted(k), k == self._last + 1
        found = registered(cloud, self._clouds[self._keyframe], TRACKING, start, start if follows else None)
        if found is None or not (found.holds_near(start) if follows else found.holds):
            self._search(k, cloud)
            return
        if follows:
            found = self._corrected_by_color(k, cloud, found)
        self._motion = inverse(self._pose) @ found.T_target_source if follows else np.eye(4)
        self._pose, self._last = found.T_target_source, k
        if found.agreeing_share < LEAST_AGREEMENT:
            self._disturbed.append(k)
        if found.overlap_share < NEW_BELOW:
            self._renew(k, cloud, self._keyframe, found)
        else:
            self._frames.append(Tracked(self._keyframe, found.T_target_source))

    def _corrected_by_color(self, k: int, cloud: OrganisedCloud, found: Registered) -> Registered:
        """Return a registration with open motions corrected by photographs, unless depth then disagrees."""
        motions = open_motions(found.information)
        if not motions.size:
            return found
        corrected = self._brightness.corrected(k, self._keyframe, found.T_target_source, motions)
        if corrected is None:
            return found
        T, information = corrected
        moved = checked(cloud, self._clouds[self._keyframe], T, found.information + information)
        return moved if moved.may_hold else found

    def track(self) -> Track:
        """Return the result."""
        of_frames = tuple(self._blind), tuple(self._disturbed)
        return Track(tuple(self._frames), self._clouds, tuple(self._links), *of_frames)

    def state(self) -> State:
        """Return the arrays from which ``iterate_restoring`` continues, without the points."""
        none = Tracked(-1, np.eye(4))
        frames = [one or none for one in self._frames]
        return {
            "keyframe_of": np.array([one.keyframe for one in frames]),
            "T_keyframe_frame": np.array([one.T_keyframe_frame for one in frames]).reshape(-1, 4, 4),
            "keyframes": np.array(list(self._clouds), int),
            "pairs": np.array([one.pair for one in self._links], int).reshape(-1, 2),
            "T_target_source": np.array([one.T_target_source for one in self._links]).reshape(-1, 4, 4),
            "information": np.array([one.information for one in self._links]).reshape(-1, 6, 6),
            "shares": np.array([(one.overlap_share, one.agreeing_share) for one in self._links]).reshape(
                -1, 2
            ),
            "blind": np.array(self._blind, int),
            "disturbed": np.array(self._disturbed, int),
            "now": np.array([self._keyframe, self._last]),
            "pose_motion": np.array([self._pose, self._motion]),
        }

    def iterate_restoring(self, recording: Recording, state: State) -> Generator[Progress, None, None]:
        """Set a state that ``state`` returned; keyframes are read again.

        So are frames without a pose, for the recording's note on images that cannot be read.
        """
        poses = zip(state["keyframe_of"].tolist(), state["T_keyframe_frame"], strict=True)
        self._frames = [None if keyframe < 0 else Tracked(keyframe, T) for keyframe, T in poses]
        keyframes = set(state["keyframes"].tolist())
        again = [k for k, one in enumerate(self._frames) if one is None or k in keyframes]
        for number, (k, view) in enumerate(read_ahead(recording, again)):
            if number % REPORTED == 0:
                yield Progress(f"reading keyframe {k} again", k / len(recording.times_s))
            if k in keyframes:
                self._clouds.add(k, organised(view.depth, view.camera))
        parts = (state[name] for name in ("pairs", "T_target_source", "information", "shares"))
        for (source, target), T, information, shares in zip(*parts, strict=True):
            overlap, agreeing = shares.tolist()
            self._links.append(Link(int(source), int(target), T, information, overlap, agreeing))
        self._blind, self._disturbed = state["blind"].tolist(), state["disturbed"].tolist()
        self._keyframe, self._last = state["now"].tolist()
        self._pose, self._motion = state["pose_motion"]

    def _predicted(self, k: int) -> FloatArray:
        """Predict a frame's pose in the keyframe, from given poses or by constant velocity."""
        given = self._given_motion(k)
        return self._pose @ (self._motion if given is None else given)

    def _given_motion(self, k: int) -> FloatArray | None:
        """Return a frame's pose in the last tracked one by given poses; None where one is unknown."""
        if not self._given:
            return None
        before, now = self._given[self._last], self._given[k]
        return None if before is None or now is None else inverse(before) @ now

    def _search(self, k: int, cloud: OrganisedCloud) -> None:
        """Look for a frame among the keyframes, the last ones first."""
        self._motion = np.eye(4)
        for keyframe in list(self._clouds)[::-1][:TRIED_KEYFRAMES]:
            start = self._pose if keyframe == self._keyframe else np.eye(4)
            found = registered(cloud, self._clouds[keyframe], TRACKING, start)
            if found is not None and found.holds:
                self._keyframe, self._pose, self._last = keyframe, found.T_target_source, k
                if found.overlap_share < NEW_BELOW:
                    self._renew(k, cloud, keyframe, found)
                else:
                    self._frames.append(Tracked(keyframe, found.T_target_source))
                return
        if k - self._last <= PATIENCE:
            self._frames.append(None)
            return
        given = self._given_motion(k)
        if given is not None:  # as good as the poses that came with the recording
            T = self._pose @ given
            self._links.append(Link(k, self._keyframe, T, GIVEN_INFORMATION, 0.0, 0.0))
        self._begin(k, cloud)

    def _renew(self, k: int, cloud: OrganisedCloud, keyframe: int, found: Registered) -> None:
        """Make the frame the current keyframe, and link it to ``keyframe``."""
        self._links.append(link(k, keyframe, found))
        self._begin(k, cloud)

    def _begin(self, k: int, cloud: OrganisedCloud) -> None:
        self._clouds.add(k, cloud)
        self._frames.append(Tracked(k, np.eye(4)))
        self._keyframe, self._pose, self._last = k, np.eye(4), k


def registered(
    source: OrganisedCloud,
    target: OrganisedCloud,
    config: RegistrationConfig,
    T_init: FloatArray,
    T_predicted: FloatArray | None = None,
) -> Registered | None:
    """Register two depth images; None if too few pairs are within the gate.

    Args:
        source: the image that moves.
        target: the image that stays.
        config: settings of the registration.
        T_init: (4, 4) start pose T_target_source.
        T_predicted: pose to which the motion so far leads; it decides where the surfaces leave a motion open,
            as along a bare wall.
    """
    if not len(source) or not len(target):
        return None
    try:
        result = register_organised(source, target, config, T_init)
    except ReconstructionError:
        return None
    if not result.steps:
        return None
    T = orthonormal(result.T_target_source)  # rounding errors double with each predicted frame
    information = registration_information(result, source.points_m, source.normals, target.normals)
    if T_predicted is not None:
        T = steadied(T, information, T_predicted)
    return checked(source, target, T, information)


def checked(
    source: OrganisedCloud, target: OrganisedCloud, T_target_source: FloatArray, information: FloatArray
) -> Registered:
    """Return a registration with its checks."""
    overlap, agreeing = shared_shares(source, target, T_target_source, WITHIN)
    _, back = shared_shares(target, source, inverse(T_target_source), WITHIN)
    return Registered(T_target_source, information, overlap, min(agreeing, back))


def steadied(T_target_source: FloatArray, information: FloatArray, T_predicted: FloatArray) -> FloatArray:
    """Return the most likely pose by a registration and a prediction together.

    A hand changes its motion by about ``PREDICTED_M`` and ``PREDICTED_RAD`` from frame to frame.

    Args:
        T_target_source: (4, 4) registered pose.
        information: (6, 6) its inverse covariance, as in ``PoseEdge``.
        T_predicted: (4, 4) predicted pose.
    """
    prior = np.diag([PREDICTED_RAD**-2.0] * 3 + [PREDICTED_M**-2.0] * 3)
    apart = small_motion(inverse(T_target_source) @ T_predicted)
    step = np.linalg.solve(information + prior, prior @ apart)
    moved: FloatArray = T_target_source @ rigid(rotation_exp(step[:3]), step[3:])
    return moved


def agreement_at(source: OrganisedCloud, target: OrganisedCloud, T_target_source: FloatArray) -> float:
    """Return the share of what both measured that agrees at a pose; 0 if they overlap too little."""
    overlap, agreeing = shared_shares(source, target, T_target_source, WITHIN)
    return agreeing if overlap >= LEAST_OVERLAP else 0.0


def loop_link(
    clouds: Mapping[int, OrganisedCloud],
    source: int,
    target: int,
    T_target_source: FloatArray | None,
    gate_m: float,
) -> Link | None:
    """Register two keyframes from a pose; None without one, or if they do not show the same place."""
    if T_target_source is None:
        return None
    config = replace(TRACKING, gate_m=gate_m)
    found = registered(clouds[source], clouds[target], config, T_target_source)
    return link(source, target, found, loop=True) if found is not None and found.holds else None


def link(source: int, target: int, found: Registered, loop: bool = False) -> Link:
    """Return a registration of two keyframes with their numbers."""
    return Link(
        source,
        target,
        found.T_target_source,
        found.information,
        found.overlap_share,
        found.agreeing_share,
        loop,
    )
