"""Compiled loops of the renderer over pixels or triangles; directions have unit length unless stated."""

from __future__ import annotations

import numba
import numpy as np

_SKIN_M = 0.003
"""Distance from a surface at which rays start, so that facets do not shadow themselves."""


@numba.njit(cache=True, nogil=True)
def corner_normals(vertices, triangles, smooth):  # type: ignore[no-untyped-def]
    """Return (F, 3, 3) float32 shading normals at the corners of triangles: the faces' normals, or if
    ``smooth`` the means of the faces around each vertex, weighted by area.

    A corner whose mean is over 60 degrees from its face's normal keeps the face's: caps keep sharp edges.
    """
    faces = np.zeros((len(triangles), 3))
    total = np.zeros((len(vertices), 3))
    for f in range(len(triangles)):
        a, b, c = vertices[triangles[f, 0]], vertices[triangles[f, 1]], vertices[triangles[f, 2]]
        x = (b[1] - a[1]) * (c[2] - a[2]) - (b[2] - a[2]) * (c[1] - a[1])
        y = (b[2] - a[2]) * (c[0] - a[0]) - (b[0] - a[0]) * (c[2] - a[2])
        z = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
        length = max(np.sqrt(x * x + y * y + z * z), 1e-20)
        faces[f, 0], faces[f, 1], faces[f, 2] = x / length, y / length, z / length
        for corner in range(3):
            total[triangles[f, corner], 0] += x
            total[triangles[f, corner], 1] += y
            total[triangles[f, corner], 2] += z
    out = np.empty((len(triangles), 3, 3), np.float32)
    for f in range(len(triangles)):
        for corner in range(3):
            blend = total[triangles[f, corner]]
            length = max(np.sqrt(blend[0] ** 2 + blend[1] ** 2 + blend[2] ** 2), 1e-20)
            lean = (blend[0] * faces[f, 0] + blend[1] * faces[f, 1] + blend[2] * faces[f, 2]) / length
            for k in range(3):
                out[f, corner, k] = blend[k] / length if smooth and lean > 0.5 else faces[f, k]
    return out


@numba.njit(cache=True, nogil=True)
def interpolate_hits(rays, t_hit, primitive, uv, corner_normals, positions, normals, view):  # type: ignore[no-untyped-def]
    """Fill (N, 3) unit directions of (N, 6) rays, and positions and normals (towards the origin) of hits."""
    for n in range(len(t_hit)):
        dx, dy, dz = rays[n, 3], rays[n, 4], rays[n, 5]
        length = np.sqrt(dx * dx + dy * dy + dz * dz)
        view[n, 0], view[n, 1], view[n, 2] = dx / length, dy / length, dz / length
        if not np.isfinite(t_hit[n]):
            continue
        f, u, v = primitive[n], uv[n, 0], uv[n, 1]
        w = np.float32(1.0) - u - v
        x = w * corner_normals[f, 0, 0] + u * corner_normals[f, 1, 0] + v * corner_normals[f, 2, 0]
        y = w * corner_normals[f, 0, 1] + u * corner_normals[f, 1, 1] + v * corner_normals[f, 2, 1]
        z = w * corner_normals[f, 0, 2] + u * corner_normals[f, 1, 2] + v * corner_normals[f, 2, 2]
        scale = np.float32(1.0) / np.sqrt(x * x + y * y + z * z)
        if x * rays[n, 3] + y * rays[n, 4] + z * rays[n, 5] > 0.0:
            scale = -scale
        normals[n, 0], normals[n, 1], normals[n, 2] = x * scale, y * scale, z * scale
        for k in range(3):
            positions[n, k] = rays[n, k] + t_hit[n] * rays[n, 3 + k]


@numba.njit(cache=True, nogil=True)
def rotate(directions, T, rays):  # type: ignore[no-untyped-def]
    """Fill (N, 6) rays from the origin of a (4, 4) pose, along any (N, 3) directions in its frame."""
    for n in range(len(directions)):
        x, y, z = directions[n, 0], directions[n, 1], directions[n, 2]
        for k in range(3):
            rays[n, k] = T[k, 3]
            rays[n, 3 + k] = T[k, 0] * x + T[k, 1] * y + T[k, 2] * z


@numba.njit(cache=True, nogil=True)
def light_rays(positions, normals, center, size_m, dither, rays, cosine_over_d2, index):  # type: ignore[no-untyped-def]
    """Fill shadow rays (t = 1 at the light) from surfaces to random points on a sphere; return their number.

    Fills the first rows of rays (N, 6), cosine_over_d2 (N,) and index (N,), for surfaces that face the light.
    """
    count = 0
    for n in range(len(positions)):
        z = np.float32(2.0) * dither[n, 0] - np.float32(1.0)
        angle = np.float32(2.0 * np.pi) * dither[n, 1]
        ring = np.sqrt(max(np.float32(0.0), np.float32(1.0) - z * z)) * size_m
        dx = center[0] + ring * np.cos(angle) - positions[n, 0]
        dy = center[1] + ring * np.sin(angle) - positions[n, 1]
        dz = center[2] + z * size_m - positions[n, 2]
        along = dx * normals[n, 0] + dy * normals[n, 1] + dz * normals[n, 2]
        if along <= 0.0:
            continue
        d2 = dx * dx + dy * dy + dz * dz
        cosine_over_d2[count] = along / np.sqrt(d2) / max(d2, size_m * size_m, np.float32(0.01))
        index[count] = n
        for k in range(3):
            rays[count, k] = positions[n, k] + np.float32(_SKIN_M) * normals[n, k]
        rays[count, 3], rays[count, 4], rays[count, 5] = dx, dy, dz
        count += 1
    return count


@numba.njit(cache=True, nogil=True)
def add_light(occluded, cosine_over_d2, index, rays, color, view, normals, gloss, irradiance, shine):  # type: ignore[no-untyped-def]
    """Add unoccluded light to (N, 3) irradiance, and the lamp's highlight (Blinn-Phong) to (N, 3) shine."""
    for m in range(len(occluded)):
        if occluded[m]:
            continue
        n = index[m]
        for k in range(3):
            irradiance[n, k] += color[k] * cosine_over_d2[m]
        if gloss[n] <= 0.02:
            continue
        lx, ly, lz = rays[m, 3], rays[m, 4], rays[m, 5]
        inverse = np.float32(1.0) / np.sqrt(lx * lx + ly * ly + lz * lz)
        hx, hy, hz = lx * inverse - view[n, 0], ly * inverse - view[n, 1], lz * inverse - view[n, 2]
        half = (hx * normals[n, 0] + hy * normals[n, 1] + hz * normals[n, 2]) / np.sqrt(
            hx * hx + hy * hy + hz * hz
        )
        power = np.float32(8.0) * np.float32(40.0) ** gloss[n]
        lobe = (power + np.float32(8.0)) / np.float32(25.0) * max(half, np.float32(0.0)) ** power
        for k in range(3):
            shine[n, k] += color[k] * cosine_over_d2[m] * lobe * gloss[n] * np.float32(0.35)


@numba.njit(cache=True, nogil=True)
def hemisphere_rays(positions, normals, dither, rays):  # type: ignore[no-untyped-def]
    """Fill (N, 6) cosine-distributed unit rays above each surface."""
    for n in range(len(positions)):
        nx, ny, nz = normals[n, 0], normals[n, 1], normals[n, 2]
        sign = np.float32(1.0) if nz >= 0.0 else np.float32(-1.0)
        a = np.float32(-1.0) / (sign + nz)  # orthonormal basis of Duff et al. 2017
        b = nx * ny * a
        radius, angle = np.sqrt(dither[n, 0]), np.float32(2.0 * np.pi) * dither[n, 1]
        s, t = radius * np.cos(angle), radius * np.sin(angle)
        c = np.sqrt(max(np.float32(0.0), np.float32(1.0) - dither[n, 0]))
        rays[n, 3] = s * (np.float32(1.0) + sign * nx * nx * a) + t * b + c * nx
        rays[n, 4] = s * sign * b + t * (sign + ny * ny * a) + c * ny
        rays[n, 5] = -s * sign * nx - t * ny + c * nz
        for k in range(3):
            rays[n, k] = positions[n, k] + np.float32(_SKIN_M) * normals[n, k]


@numba.njit(cache=True, nogil=True)
def mirror_rays(positions, normals, view, roughness, dither, rays):  # type: ignore[no-untyped-def]
    """Fill (N, 6) mirrored rays, spread by an (N,) roughness; their directions do not have unit length."""
    for n in range(len(positions)):
        along = view[n, 0] * normals[n, 0] + view[n, 1] * normals[n, 1] + view[n, 2] * normals[n, 2]
        z = np.float32(2.0) * dither[n, 0] - np.float32(1.0)
        angle = np.float32(2.0 * np.pi) * dither[n, 1]
        ring = np.sqrt(max(np.float32(0.0), np.float32(1.0) - z * z)) * roughness[n]
        jitter = (ring * np.cos(angle), ring * np.sin(angle), z * roughness[n])
        out = np.float32(0.0)
        for k in range(3):
            rays[n, 3 + k] = view[n, k] - np.float32(2.0) * along * normals[n, k] + jitter[k]
            out += rays[n, 3 + k] * normals[n, k]
        for k in range(3):
            rays[n, 3 + k] -= min(out, np.float32(0.0)) * np.float32(2.0) * normals[n, k]
            rays[n, k] = positions[n, k] + np.float32(_SKIN_M) * normals[n, k]


@numba.njit(cache=True, nogil=True)
def smooth_within_surfaces(image, positions, normals, z_m, radius):  # type: ignore[no-untyped-def]
    """Return (H, W, 3) means of each pixel's known (not NaN) neighbours on the same plane; edges stay sharp.

    A pixel without such a neighbour takes the mean of all known ones within ``radius`` pixels. The outermost
    neighbours count half, so that patterns with a period of twice the radius vanish.
    """
    height, width = z_m.shape
    out = np.zeros_like(image)
    for y in range(height):
        for x in range(width):
            limit = np.float32(0.008) * z_m[y, x]
            nx, ny, nz = normals[y, x, 0], normals[y, x, 1], normals[y, x, 2]
            px, py, pz = positions[y, x, 0], positions[y, x, 1], positions[y, x, 2]
            r, g, b, total = np.float32(0.0), np.float32(0.0), np.float32(0.0), np.float32(0.0)
            for strict in (True, False):
                for j in range(max(0, y - radius), min(height, y + radius + 1)):
                    for i in range(max(0, x - radius), min(width, x + radius + 1)):
                        if np.isnan(image[j, i, 0]):
                            continue
                        if strict:
                            alike = normals[j, i, 0] * nx + normals[j, i, 1] * ny + normals[j, i, 2] * nz
                            dx, dy, dz = (
                                positions[j, i, 0] - px,
                                positions[j, i, 1] - py,
                                positions[j, i, 2] - pz,
                            )
                            if alike < 0.9 or abs(dx * nx + dy * ny + dz * nz) > limit:
                                continue
                        weight = np.float32(1.0) if abs(j - y) < radius else np.float32(0.5)
                        weight *= np.float32(1.0) if abs(i - x) < radius else np.float32(0.5)
                        r += weight * image[j, i, 0]
                        g += weight * image[j, i, 1]
                        b += weight * image[j, i, 2]
                        total += weight
                if total > 0.0:
                    break
            out[y, x, 0], out[y, x, 1], out[y, x, 2] = r / total, g / total, b / total
    return out
