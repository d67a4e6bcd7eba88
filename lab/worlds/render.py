"""Ray-cast photographs of a scene, with the depth, normals and reflectance that the sensor model needs."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np

from lab.worlds import shading
from lab.worlds.film import Film, develop
from lab.worlds.pixels import camera_rays, dither, lit_pixels
from lab.worlds.raycast import Hits, RayCaster
from lab.worlds.scene import Part, Scene
from pipeline.types import ByteArray, CameraIntrinsics, FloatArray, IntArray

Quality = Literal["fast", "photo"]


@dataclass(frozen=True, slots=True)
class View:
    """One rendered image and the true geometry, all on the same pixel grid."""

    rgb: ByteArray
    """(H, W, 3)."""
    z_m: FloatArray
    """(H, W) float32 depth along the optical axis at the pixel centres; NaN if the ray meets nothing."""
    normals: FloatArray
    """(H, W, 3) unit normals in the world frame, towards the camera; zero if the ray meets nothing."""
    infrared: FloatArray
    """(H, W) infrared albedo, 0 to 1."""
    gloss: FloatArray
    """(H, W) strength of the mirror-like reflection, 0 to 1."""
    T_world_camera: FloatArray
    """(4, 4) pose of the camera."""


@dataclass(frozen=True, slots=True)
class Exposure:
    """The light and the true geometry of a view, before the film makes a photograph of the light."""

    radiance: FloatArray
    """(H, W, 3) float32 linear light."""
    z_m: FloatArray
    normals: FloatArray
    infrared: FloatArray
    gloss: FloatArray
    T_world_camera: FloatArray
    """This and the fields before it are as in ``View``."""

    def developed(self, film: Film, rng: np.random.Generator) -> View:
        """Return the photograph with the true geometry."""
        rgb = develop(self.radiance, film, rng)
        return View(rgb, self.z_m, self.normals, self.infrared, self.gloss, self.T_world_camera)


@dataclass(frozen=True, slots=True)
class _Sampling:
    """The rays and the film of a render quality."""

    offsets_px: tuple[tuple[float, float], ...]
    """Offset of each pass's rays from the pixel centres."""
    rays: int
    """Shadow rays per light, pass and pixel, and sky rays over the hemisphere per pass and pixel."""
    thorough: bool
    """Trace light at all pixels, not only at every other one (checkerboard), and collect the light of the
    surfaces that sky rays hit, instead of counting them as occluders only."""
    film: Film


_ROTATED_GRID_PX = ((0.125, 0.375), (-0.375, 0.125), (0.375, -0.125), (-0.125, -0.375))
_HASTY_FILM = Film(0.5, 0.08, noise=(0.0, 0.03), blur_px=(0.25, 0.75), vignette=(0.0, 0.25))
_SAMPLING = {
    "fast": _Sampling(((0.0, 0.0),), rays=1, thorough=False, film=_HASTY_FILM),
    "photo": _Sampling(_ROTATED_GRID_PX, rays=4, thorough=True, film=Film()),
}
_DULL = 0.05
"""Gloss up to which parts do not mirror their surroundings; lamps have highlights on them from 0.02."""
_REACH_M = 1.2
"""Distance within which objects occlude the ambient light."""


class Renderer:
    """Renders views of one scene; creating it prepares the ray casting, so keep it for several views.

    Args:
        scene: the scene. Parts with emission do not cast shadows, so that lamps shine through shades.
        threads: Embree threads; 0 takes all cores.
    """

    def __init__(self, scene: Scene, threads: int = 0) -> None:
        self.scene = scene
        self._caster = RayCaster(scene, threads)
        materials = [part.material for part in scene.parts]
        self._gloss = np.array([m.gloss for m in materials] + [0.0], np.float32)
        self._infrared = np.array([m.infrared for m in materials] + [0.0], np.float32)
        self._emission = np.array([m.emission for m in materials] + [0.0], np.float32)
        self._mirror = np.where(self._emission > 0.0, np.float32(0.0), self._gloss)  # no reflections on lamps
        self._ambient = np.asarray(scene.ambient, np.float32)

    @cached_property
    def _mean_albedo(self) -> FloatArray:
        """Return (parts + 1, 3) mean albedo of each part; the last row, black, is for rays without a hit."""
        return np.stack([*(_mean_albedo(part) for part in self.scene.parts), np.zeros(3, np.float32)])

    def view(
        self,
        intrinsics: CameraIntrinsics,
        T_world_camera: FloatArray,
        quality: Quality,
        rng: np.random.Generator,
    ) -> View:
        """Render one view (H, W of ``intrinsics``)."""
        return self.exposure(intrinsics, T_world_camera, quality, rng).developed(_SAMPLING[quality].film, rng)

    def exposure(
        self,
        intrinsics: CameraIntrinsics,
        T_world_camera: FloatArray,
        quality: Quality,
        rng: np.random.Generator,
    ) -> Exposure:
        """Return the light and the true geometry of one view (H, W of ``intrinsics``)."""
        sampling = _SAMPLING[quality]
        shape = (intrinsics.height_px, intrinsics.width_px)
        center = self._caster.cast(camera_rays(intrinsics, T_world_camera))
        albedo = self._albedo(center)
        radiance = np.zeros((*shape, 3), np.float32)
        for offset_px in sampling.offsets_px:
            if any(offset_px):
                hits = self._caster.cast(camera_rays(intrinsics, T_world_camera, offset_px))
                radiance += self._radiance(hits, self._albedo(hits), shape, sampling, rng)
            else:
                radiance += self._radiance(center, albedo, shape, sampling, rng)
        seen = center.part >= 0
        return Exposure(
            radiance=radiance / len(sampling.offsets_px),
            z_m=np.where(seen, center.t, np.float32(np.nan)).reshape(shape),
            normals=center.normals.reshape(*shape, 3),
            infrared=np.clip(_luminance(albedo) * self._infrared[center.part], 0.0, 1.0).reshape(shape),
            gloss=self._gloss[center.part].reshape(shape),
            T_world_camera=T_world_camera,
        )

    def depth(self, intrinsics: CameraIntrinsics, T_world_camera: FloatArray) -> FloatArray:
        """Return (H, W) float32 true depth at the pixel centres; NaN if the ray meets nothing."""
        return self.parts_seen(intrinsics, T_world_camera)[0]

    def parts_seen(
        self, intrinsics: CameraIntrinsics, T_world_camera: FloatArray
    ) -> tuple[FloatArray, IntArray]:
        """Return (H, W) depth as in ``depth``, and the (H, W) part index at each pixel, -1 for none."""
        hits = self._caster.cast(camera_rays(intrinsics, T_world_camera))
        shape = (intrinsics.height_px, intrinsics.width_px)
        z_m = np.where(hits.part >= 0, hits.t, np.float32(np.nan))
        return z_m.reshape(shape), hits.part.reshape(shape)

    def irradiance(
        self, positions_m: FloatArray, normals: FloatArray, rng: np.random.Generator, rays: int = 4
    ) -> FloatArray:
        """Return (H, W, 3) irradiance of an object that is not in the scene and casts no shadow.

        Args:
            positions_m: (H, W, 3) points of its surface, world frame.
            normals: (H, W, 3) unit, towards the lit side.
            rng: draws the rays.
            rays: shadow rays per light and position, and sky rays per position.
        """
        shape = positions_m.shape[:2]
        places, up = (array.reshape(-1, 3).astype(np.float32) for array in (positions_m, normals))
        count = len(places)
        hits = Hits(np.ones(count, np.float32), places, up, -up, np.full(count, -1))
        light, shine = np.zeros((2, count, 3), np.float32)
        for _ in range(rays):
            self._add_lights(hits, np.zeros(count, np.float32), dither(shape, rng), light, shine)
            light += self._sky(hits, dither(shape, rng), bounce=True)
        return (light / rays).reshape(*shape, 3)

    def _albedo(self, hits: Hits) -> FloatArray:
        """Return (N, 3) albedo from the parts' textures, black for misses."""
        albedo = np.zeros((len(hits.part), 3), np.float32)
        order = np.argsort(hits.part, kind="stable")
        bounds = np.searchsorted(hits.part[order], np.arange(len(self.scene.parts) + 1))
        for k, part in enumerate(self.scene.parts):
            rows = order[bounds[k] : bounds[k + 1]]
            if len(rows):
                albedo[rows] = _evaluate(part, hits.positions[rows], hits.normals[rows])
        return albedo

    def _radiance(
        self,
        hits: Hits,
        albedo: FloatArray,
        shape: tuple[int, int],
        sampling: _Sampling,
        rng: np.random.Generator,
    ) -> FloatArray:
        """Return (H, W, 3) light towards the camera, traced at ``lit_pixels`` and spread over surfaces."""
        lit = lit_pixels(shape, sampling.thorough)
        some = hits.select(lit)
        direct, shine, sky = (np.zeros((len(lit), 3), np.float32) for _ in range(3))
        for _ in range(sampling.rays):
            self._add_lights(some, self._mirror[some.part], dither(shape, rng)[lit], direct, shine)
        for _ in range(sampling.rays):
            sky += self._sky(some, dither(shape, rng)[lit], sampling.thorough)
        shine /= sampling.rays
        self._add_mirrored(some, albedo[lit], dither(shape, rng)[lit], sampling.thorough, shine)

        light, glint = np.full((2, len(hits.t), 3), np.nan, np.float32)
        light[lit] = direct / sampling.rays + sky / sampling.rays
        glint[lit] = shine
        radiance = albedo * (_smoothed(light, hits, shape) + self._emission[hits.part][:, None])
        if shine.any():
            radiance *= 1.0 - _mirror_share(hits, self._mirror[hits.part])[:, None]
            radiance += _smoothed(glint, hits, shape)
        return radiance.reshape(*shape, 3)

    def _add_lights(
        self,
        hits: Hits,
        gloss: FloatArray,
        random: FloatArray,
        irradiance: FloatArray,
        shine: FloatArray,
        shadows: bool = True,
    ) -> None:
        """Add each light to (N, 3) irradiance, by one shadow ray or, without ``shadows``, as if unoccluded.

        Its highlights on surfaces of (N,) ``gloss`` are added to (N, 3) ``shine``.
        """
        count = len(hits.t)
        rays, weight = np.empty((count, 6), np.float32), np.empty(count, np.float32)
        index = np.empty(count, np.int64)
        for light in self.scene.lights:
            center, color = np.asarray(light.position_m, np.float32), np.asarray(light.color, np.float32)
            used = shading.light_rays(
                hits.positions, hits.normals, center, np.float32(light.size_m), random, rays, weight, index
            )
            blocked = self._caster.occluded(rays[:used], 0.999) if shadows else np.zeros(used, bool)
            lamp = (blocked, weight[:used], index[:used], rays, color)
            shading.add_light(*lamp, hits.view, hits.normals, gloss, irradiance, shine)

    def _sky(self, hits: Hits, random: FloatArray, bounce: bool) -> FloatArray:
        """Return (N, 3) ambient irradiance, by one random ray per position.

        With ``bounce``, 0.7 of its light comes from the surface that it meets. Without, it brings the ambient
        light, or 0.35 of it if it meets a part within ``_REACH_M``.
        """
        rays = np.empty((len(hits.t), 6), np.float32)
        shading.hemisphere_rays(hits.positions, hits.normals, random, rays)
        if bounce:
            return 0.7 * self._met(rays, random, True) + 0.3 * self._ambient
        blocked = self._caster.occluded(rays, _REACH_M)
        return np.where(blocked[:, None], 0.35 * self._ambient, self._ambient).astype(np.float32)

    def _met(self, rays: FloatArray, random: FloatArray, shadows: bool) -> FloatArray:
        """Return (N, 3) light of the surfaces that rays meet, by their mean albedo; ambient for misses."""
        hits = self._caster.cast(rays)
        light = np.zeros((len(rays), 3), np.float32)
        self._add_lights(hits, np.zeros(len(rays), np.float32), random, light, light, shadows)
        near = np.clip(hits.t / _REACH_M, 0.1, 1.0)[:, None]
        light += self._ambient * near + self._emission[hits.part][:, None]
        light *= self._mean_albedo[hits.part]
        light[hits.part < 0] = self._ambient
        return light

    def _add_mirrored(
        self, hits: Hits, albedo: FloatArray, random: FloatArray, shadows: bool, shine: FloatArray
    ) -> None:
        """Add reflections of glossy parts to (N, 3) shine, blurred by roughness and tinted by albedo."""
        rows = np.flatnonzero(self._mirror[hits.part] > _DULL)
        if not len(rows):
            return
        hits, albedo, random = hits.select(rows), albedo[rows], random[rows]
        gloss = self._mirror[hits.part]
        rays = np.empty((len(rows), 6), np.float32)
        roughness = np.float32(0.3) * (1.0 - gloss) ** 2
        shading.mirror_rays(hits.positions, hits.normals, hits.view, roughness, random, rays)
        tint = 1.0 - gloss[:, None] * (1.0 - albedo)
        reflected = np.minimum(self._met(rays, random, shadows), 6.0 * self._ambient.max() + 0.5)
        shine[rows] += _mirror_share(hits, gloss)[:, None] * tint * reflected


def render(
    scene: Scene,
    intrinsics: CameraIntrinsics,
    T_world_camera: FloatArray,
    quality: Quality,
    rng: np.random.Generator,
) -> View:
    """Render one view of a scene; use ``Renderer`` for several."""
    return Renderer(scene).view(intrinsics, T_world_camera, quality, rng)


def _evaluate(part: Part, positions_m: FloatArray, normals: FloatArray) -> FloatArray:
    """Return (N, 3) albedo at world positions of a part."""
    T = part.T_world_part.astype(np.float32)
    return part.material.texture((positions_m - T[:3, 3]) @ T[:3, :3], normals @ T[:3, :3])


def _mean_albedo(part: Part) -> FloatArray:
    """Return the (3,) mean of the texture over three positions on each of at most 39 triangles."""
    triangles = np.ascontiguousarray(part.triangles[:: max(1, len(part.triangles) // 20)])
    weights = np.array([[3, 3, 4], [7, 2, 1], [1, 7, 2]], np.float32) / 10.0
    corners = part.vertices_m[triangles].astype(np.float32)
    places = np.einsum("wc,fck->wfk", weights, corners).reshape(-1, 3)
    normals = shading.corner_normals(part.vertices_m, triangles, False)[:, 0]
    return part.material.texture(places, np.tile(normals, (3, 1))).mean(axis=0).astype(np.float32)


def _mirror_share(hits: Hits, gloss: FloatArray) -> FloatArray:
    """Return (N,) share of the light that is mirrored, more at grazing angles (after Schlick)."""
    grazing = (1.0 - np.clip(-np.einsum("nk,nk->n", hits.view, hits.normals), 0.0, 1.0)) ** 4
    return np.where(gloss > _DULL, gloss * (gloss + (1.0 - gloss) * grazing), np.float32(0.0))


def _smoothed(image: FloatArray, hits: Hits, shape: tuple[int, int]) -> FloatArray:
    """Return (H * W, 3) light, averaged over neighbours on the same surface; NaN pixels are filled."""
    surface = (hits.positions.reshape(*shape, 3), hits.normals.reshape(*shape, 3), hits.t.reshape(shape))
    return shading.smooth_within_surfaces(image.reshape(*shape, 3), *surface, 2).reshape(-1, 3)


def _luminance(rgb: FloatArray) -> FloatArray:
    return rgb @ np.array([0.2126, 0.7152, 0.0722], np.float32)
