"""Drawing of a delivery in the room: cameras with their arrived pictures, packets in flight, and the mesh."""

from __future__ import annotations

import numpy as np
import viser

from app.drawing.clouds import clear, shorten
from app.drawing.colors import BACKGROUND, DELIVERED, NEUTRAL
from app.drawing.packing import rounded
from app.drawing.poses import place
from app.drawing.timeline import Color
from app.screens.network.delivery_view import DeliveryView, MomentView, PacketView
from app.screens.network.draw import MOST_PACKETS, ON_THE_WAY, Flights
from app.screens.network.labels import CAUSES
from app.screens.network.name_lifts import LINE_PX, lifts
from app.screens.network.state_colors import BUSY, EMPTY, FULL, between, state_color
from app.screens.network.view import What
from app.screens.network.walk_draw import keyframe_label, places_at, routes_m
from network_sim.types import Cause
from pipeline.types import FloatArray

FRUSTUM = 0.08
"""viser's ``scale`` of a frustum over D, the distance from the cameras' mean to the middle of their view."""
SINK_AWAY = 0.5
"""Distance at which the sink is drawn to the left of the cameras, over D; the real one may be far away."""
ELEVATION_RAD = np.radians(40.0)
FILLED = 0.8
"""Share of the window that the drawing fills."""
PACKET, POINT_M = 0.011, 0.008
"""Size of a packet over D, and size of a point in metres."""
NAME_BELOW = 0.05
"""Distance of a name below its camera over D: there it covers neither pictures nor mesh."""
NARROW_PX = 600.0
"""Width below which only the cameras' names are shown, without data and energy."""
LONGEST = 8
"""Number of letters reserved for the energy, which is written after a node's name and share."""
LIT = (255, 230, 0)


class DeliveryDrawing:
    """Drawing of a delivery below a scene node; it can show any time of the delivery."""

    def __init__(self, scene: viser.SceneApi, below: str, view: DeliveryView) -> None:
        clear(scene, below)
        self._scene, self._below, self._view = scene, below, view
        stage = view.stage
        cameras_m = np.array([node.T_world_camera[:3, 3] for node in view.nodes])
        middle_m = cameras_m.mean(axis=0)
        self._size_m = max(float(np.linalg.norm(stage.middle_m - middle_m)), 0.5)
        self._places_m = self._places(cameras_m)
        cloud_m = self._places_m[-1]
        self._client_m = cloud_m + 0.4 * self._size_m * stage.right
        self._flights = Flights.of(view.run.pieces)
        self._frusta: list[viser.CameraFrustumHandle] = []
        self._names: list[viser.LabelHandle] = []
        self._marks: dict[str, viser.LabelHandle] = {}
        """Labels of the sink, the cloud and the client."""
        self._lifts_m: list[FloatArray] = [np.zeros(3)] * len(view.nodes)
        """(3,) offset of each node's name from its usual place below the camera, so that none overlap."""
        self._narrow = False
        self._batteries: list[viser.IcosphereHandle] = []
        self._clouds: list[viser.PointCloudHandle | None] = [None] * len(view.nodes)
        self._meshes: list[viser.GlbHandle] = []
        self._losses: dict[int, viser.LabelHandle] = {}
        self._made = 0
        self._shown: MomentView | None = None
        self._lit_row = -1
        self._add_nodes()
        self._add_moved(cameras_m)
        self._add_marks()
        self._add_routes()
        capacity = MOST_PACKETS + len(view.run.names)
        self._packets = scene.add_point_cloud(
            f"{below}/packets",
            np.zeros((capacity, 3), np.float32),
            np.zeros((capacity, 3), np.uint8),
            point_size=PACKET * self._size_m,
            point_shape="circle",
            point_shading="flat",
            precision="float32",
        )

    def viewpoint(self, fov_rad: float, aspect: float) -> tuple[FloatArray, FloatArray]:
        """Return (3,) look-at point and (3,) camera position that show room, cameras, sink and client."""
        stage = self._view.stage
        ends_m = 0.5 * stage.width_m * stage.right
        seen_m = np.vstack(
            [stage.middle_m - ends_m, stage.middle_m + ends_m, stage.top_m, self._places_m, self._client_m]
        )
        away = stage.viewpoint_m - stage.middle_m
        away[2] = np.hypot(*away[:2]) * np.tan(ELEVATION_RAD)
        away /= max(float(np.linalg.norm(away)), 1e-9)
        middle_m = 0.5 * (seen_m.min(axis=0) + seen_m.max(axis=0))
        up = np.cross(stage.right, -away)
        from_middle_m = seen_m - middle_m
        slope = np.tan(0.5 * fov_rad)
        across = np.abs(from_middle_m @ stage.right) / (slope * aspect)
        along = np.abs(from_middle_m @ up) / slope
        distance_m = float((np.maximum(across, along) / FILLED + from_middle_m @ away).max())
        return middle_m, middle_m + distance_m * away

    def spread_names(self, fov_rad: float, aspect: float, height_px: float) -> None:
        """Move the names so that none overlaps another in this window; shorten them if it is narrow."""
        self._narrow = aspect * height_px < NARROW_PX
        middle_m, stand_m = self.viewpoint(fov_rad, aspect)
        forward = (middle_m - stand_m) / np.linalg.norm(middle_m - stand_m)
        right = self._view.stage.right
        up = np.cross(right, forward)
        self._lifts_m = [np.zeros(3)] * len(self._names)
        for row in range(len(self._names)):
            self._move_camera(row, self._pose(row, self._shown))
        labels = [*self._marks.values(), *self._names]
        from_m = np.array([label.position for label in labels]) - stand_m
        px_m = 2.0 * np.tan(0.5 * fov_rad) * (from_m @ forward) / max(height_px, 1.0)
        letters = [len(label.text) for label in self._marks.values()]
        more = len(" · off") if self._narrow else len(" · 100 %") + LONGEST
        letters += [len(node.name) + more for node in self._view.nodes]
        down_px = np.column_stack([from_m @ right, -(from_m @ up)]) / px_m[:, None]
        down_px[: len(self._marks), 1] -= LINE_PX  # these labels are above their places, the others below
        lifts_px = lifts(down_px, np.array(letters), len(self._marks))
        self._lifts_m = [
            -lift_px * one_m * up for lift_px, one_m in zip(lifts_px, px_m[len(self._marks) :], strict=True)
        ]
        for row in range(len(self._names)):
            self._move_camera(row, self._pose(row, self._shown))

    def place_m(self, name: str) -> FloatArray:
        """Return the (3,) drawn place of the sink or of a node's radio; of a failed node, its camera's."""
        run = self._view.run
        if name == "sink":
            return self._places_m[run.roles.index(name)]
        node = next((one for one in self._view.nodes if one.name == name), self._view.nodes[0])
        return self._places_m[node.row] if node.row >= 0 else node.T_world_camera[:3, 3]

    # The state at the clock's time.

    def show(self, now_ns: int, shown_ns: int) -> None:
        """Show the frames at ``now_ns``; flights last at least ``shown_ns``, and losses stay that long."""
        at = places_at(self._view, self._places_m, now_ns)
        if self._view.walk:
            self._batteries[0].position = at[0]
        points, colors = self._flights.packets(now_ns, shown_ns, at)
        lost_m, red = self._flights.losses(now_ns, shown_ns, at)
        batch = np.tile(np.array((0.0, 0.0, -1000.0), np.float32), (len(self._packets.points), 1))
        shade = np.tile(np.array(BACKGROUND, np.uint8), (len(batch), 1))
        both = np.concatenate([points, lost_m])[: len(batch)]
        batch[: len(both)], shade[: len(both)] = both, np.concatenate([colors, red])[: len(batch)]
        self._packets.points, self._packets.colors = batch, shade
        self._packets.visible = bool(len(both))
        self._show_causes(now_ns, shown_ns)

    def show_moment(self, moment: MomentView | None, most_j: float = 0.0) -> bool:
        """Show pictures, clouds and mesh of a moment; None shows the state before anything has arrived.

        Args:
            moment: the moment.
            most_j: energy at which a node's battery has the colour of an empty one.

        Returns:
            Whether the previous mesh is still drawn with the new one; showing the moment again removes it.
        """
        self._show_batteries(moment, most_j)
        if moment is self._shown:
            shorten(self._meshes, 1)
        else:
            self._show_pictures(moment)
        return len(self._meshes) > 1

    def _show_pictures(self, moment: MomentView | None) -> None:
        self._shown = moment
        for row, node in enumerate(self._view.nodes):
            now = None if moment is None else moment.nodes[row]
            share = 0.0 if now is None else now.delivered_bytes / max(node.total_bytes, 1)
            self._move_camera(row, self._pose(row, moment))
            self._show_picture(row)
            self._frusta[row].color = state_color(node.row < 0, share)
            self._show_cloud(row, None if now is None or not len(now.points_m) else now)
        self._show_mesh(b"" if moment is None else moment.glb)

    def _move_camera(self, row: int, T_world_camera: FloatArray) -> None:
        """Move a camera's frustum and name to a pose (registration may change it), and update the name."""
        place(self._frusta[row], T_world_camera)
        below_m = np.array((0.0, 0.0, NAME_BELOW * self._size_m))
        self._names[row].position = T_world_camera[:3, 3] - below_m + self._lifts_m[row]
        self._names[row].text = self._name(row)

    def _name(self, row: int) -> str:
        """Return a camera's label: its name and, in a wide window, the arrived share and used energy."""
        node, shown = self._view.nodes[row], self._shown
        if node.row < 0:
            return f"{node.name} · off"
        if self._narrow or shown is None:
            return node.name
        now = shown.nodes[row]
        if self._view.walk:
            return keyframe_label(node, now)
        percent = 100.0 * now.delivered_bytes / max(node.total_bytes, 1)
        return f"{node.name} · {percent:.0f} % · {now.energy_j:.3g} J"

    def _show_picture(self, row: int) -> None:
        """Show the arrived part of a node's picture."""
        shown = self._shown
        dark = _dark(self._view.nodes[row].aspect)
        self._frusta[row].image = dark if shown is None else shown.nodes[row].picture

    def _show_batteries(self, moment: MomentView | None, most_j: float) -> None:
        for row, battery in enumerate(self._batteries):
            used_j = 0.0 if moment is None else moment.nodes[row].energy_j
            color = between(FULL, EMPTY, min(used_j / most_j, 1.0) if most_j > 0.0 else 0.0)
            if battery.color != color:
                battery.color = color

    def light(self, packet: PacketView | None) -> None:
        """Highlight the pixels and points of a packet; None removes the highlight."""
        name = f"{self._below}/lit"
        if self._scene.get_handle_by_name(name) is not None:
            self._scene.remove_by_name(name)
        if self._lit_row >= 0:
            self._show_picture(self._lit_row)
        self._lit_row = -1 if packet is None else packet.row
        if packet is None:
            return
        self._frusta[packet.row].image = packet.picture
        if len(packet.points_m):
            pose = self._pose(packet.row, self._shown)
            cloud = self._scene.add_point_cloud(
                name, packet.points_m, np.array(LIT, np.uint8), point_size=4 * POINT_M, precision="float32"
            )
            place(cloud, pose)

    def _pose(self, row: int, moment: MomentView | None) -> FloatArray:
        if moment is None:
            return self._view.nodes[row].T_world_camera
        return moment.nodes[row].T_world_camera

    def _show_cloud(self, row: int, now: object) -> None:
        old, self._clouds[row] = self._clouds[row], None
        if old is not None:
            old.remove()
        if now is None:
            return
        self._made += 1
        handle = self._scene.add_point_cloud(
            f"{self._below}/cloud-{self._view.nodes[row].name}-{self._made}",
            rounded(now.points_m),  # type: ignore[attr-defined]
            now.colors,  # type: ignore[attr-defined]
            point_size=POINT_M,
            point_shape="rounded",
            point_shading="flat",
            precision="float32",
        )
        place(handle, now.T_world_camera)  # type: ignore[attr-defined]
        self._clouds[row] = handle

    def _show_mesh(self, glb: bytes) -> None:
        """Add a mesh and keep the one before it, so that no gap is seen; empty ``glb`` removes all."""
        shorten(self._meshes, 1 if glb else 0)
        if glb:
            name = f"{self._below}/mesh-{self._made}"
            self._made += 1
            self._meshes.append(self._scene.add_glb(name, glb, cast_shadow=False))

    def _show_causes(self, now_ns: int, shown_ns: int) -> None:
        """Show the causes of recent losses as words at the places where they happened."""
        failures, recent = self._flights.failures, {}
        first, last = np.searchsorted(failures.start_ns, (now_ns - shown_ns, now_ns), side="right")
        for index in range(max(first, last - 20), last):
            lost = failures.what[index] == What.LOSS
            there = lost and failures.cause[index] in ON_THE_WAY and failures.peer[index] >= 0
            node = int(failures.peer[index] if there else failures.node[index])
            recent[node] = CAUSES[Cause(int(failures.cause[index]))]
        for node, handle in self._losses.items():
            handle.visible = node in recent
        for node, cause in recent.items():
            text = f"lost: {cause}"
            if node not in self._losses:
                self._losses[node] = self._label(
                    f"cause-{node}", text, self._places_m[node] - (0.0, 0.0, 0.12 * self._size_m), 0.8
                )
            elif self._losses[node].text != text:
                self._losses[node].text = text

    # Constant parts.

    def _places(self, cameras_m: FloatArray) -> FloatArray:
        """Return (N, 3) places of the network's members: nodes at their cameras, unless their radios were
        moved; the sink and the cloud next to them.
        """
        run, left = self._view.run, -self._view.stage.right
        sink_m = cameras_m.mean(axis=0) + (np.ptp(cameras_m @ left) / 2.0 + SINK_AWAY * self._size_m) * left
        places_m = np.tile(sink_m, (len(run.names), 1))
        moved = self._view.sent.network.nodes.places_m
        for node, camera_m in zip(self._view.nodes, cameras_m, strict=True):
            if node.row >= 0:
                places_m[node.row] = camera_m
                if moved:
                    places_m[node.row, :2] = run.positions_m(run.start_ns)[node.row]
        for row, role in enumerate(run.roles):
            if role == "cloud":
                places_m[row] = sink_m + self._size_m * np.array([0.0, 0.0, 0.45])
        return places_m

    def _add_nodes(self) -> None:
        for node in self._view.nodes:
            name = f"{self._below}/{node.name}"
            frustum = self._scene.add_camera_frustum(
                name,
                fov=node.fov_rad,
                aspect=node.aspect,
                scale=FRUSTUM * self._size_m,
                thickness=0.004 * self._size_m,
                color=BUSY,
                image=_dark(node.aspect),
            )
            place(frustum, node.T_world_camera)
            self._frusta.append(frustum)
            if not self._view.walk or not self._batteries:
                battery = f"battery-{node.name}"
                self._batteries.append(self._mark(battery, self.place_m(node.name), FULL, 0.5))
            camera_m = node.T_world_camera[:3, 3]
            self._names.append(self._label(f"name-{node.name}", node.name, camera_m, 0.9))
            self._names[-1].anchor = "top-center"

    def _add_moved(self, cameras_m: FloatArray) -> None:
        """Draw a line from each camera to its radio if the radio is elsewhere."""
        for node, camera_m in zip(self._view.nodes, cameras_m, strict=True):
            radio_m = self.place_m(node.name)
            if not self._view.walk and np.linalg.norm(radio_m - camera_m) > 1e-3:
                self._lines(f"moved-{node.name}", np.array([[camera_m, radio_m]]))

    def _add_marks(self) -> None:
        view, roles = self._view.run, self._view.run.roles
        positions_m = view.positions_m(view.start_ns)
        cameras_m = positions_m[[role == "node" for role in roles]]
        for row, role in enumerate(roles):
            if role == "node":
                continue
            color = DELIVERED if role == "sink" else NEUTRAL
            self._mark(role, self._places_m[row], color)
            text = role
            if role == "sink":
                away_m = float(np.linalg.norm(positions_m[row] - cameras_m.mean(axis=0)))
                text = f"sink, {away_m:.0f} m away" if away_m >= 0.5 else "sink, amid the nodes"
            self._marks[role] = self._label(
                f"name-{role}", text, self._places_m[row] + (0.0, 0.0, 0.05 * self._size_m), 0.9
            )
        if "cloud" in roles:
            cloud_m = self._places_m[roles.index("cloud")]
            client_m = self._client_m
            self._mark("client", client_m, NEUTRAL)
            above_m = client_m + np.array([0.0, 0.0, 0.05 * self._size_m])
            self._marks["client"] = self._label("name-client", "client: you", above_m, 0.9)
            sink_m = self._places_m[roles.index("sink")]
            self._lines("to-client", np.array([[sink_m, cloud_m], [cloud_m, client_m]]))

    def _add_routes(self) -> None:
        """Draw a line from each sender to each receiver of its frames."""
        frames = self._flights.frames
        frames = frames.where(frames.what == What.AIR)
        pairs = np.unique(np.column_stack([frames.node, frames.peer]), axis=0)
        if len(pairs):
            self._lines("routes", routes_m(self._view, self._places_m, pairs))

    def _mark(self, name: str, place_m: FloatArray, color: Color, size: float = 1.0) -> viser.IcosphereHandle:
        radius_m = 0.028 * size * self._size_m
        return self._scene.add_icosphere(
            f"{self._below}/{name}", radius=radius_m, color=color, position=place_m
        )

    def _label(self, name: str, text: str, place_m: FloatArray, size: float) -> viser.LabelHandle:
        return self._scene.add_label(
            f"{self._below}/{name}", text, position=place_m, font_screen_scale=size, anchor="bottom-center"
        )

    def _lines(self, name: str, ends_m: FloatArray) -> None:
        self._scene.add_line_segments(
            f"{self._below}/{name}",
            ends_m.astype(np.float32),
            np.array(NEUTRAL, np.uint8),
            thickness=1.5,
            thickness_units="screen",
        )


def _dark(aspect: float) -> np.ndarray:
    return np.full((12, max(1, round(12 * aspect)), 3), 48, np.uint8)
