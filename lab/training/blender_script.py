"""Path-trace the views of an exchange file (see blend.py); runs alone in an environment with ``bpy``.

``python blender_script.py room.npz light.npy --samples 16 --threads 1`` writes the light of all views as (N,
H, W, 3) float16, linear Rec. 709.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from mathutils import Matrix

_SENSOR_MM = 36.0
_BRIGHTEST = 6e4
"""Limit of the light, a little below the largest half float."""


def main() -> None:
    """Parse the command line, build the scene, render it view by view."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("exchange", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--samples", type=int, default=16)
    parser.add_argument("--threads", type=int, default=1)
    arguments = parser.parse_args()
    bpy.ops.wm.read_factory_settings(use_empty=True)
    with np.load(arguments.exchange) as stored, tempfile.TemporaryDirectory() as folder:
        room = dict(stored)
        _set_up(bpy.context.scene, arguments.samples, arguments.threads)
        materials = _materials(room, Path(folder))
        glows = room["emission"][room["material"]] > 0.0
        _mesh("solid", room, materials, ~glows)
        _mesh("glowing", room, materials, glows).visible_shadow = False
        _lights(room)
        _ambient(room["ambient"])
        np.save(arguments.out, np.stack(_pictures(room, Path(folder))))


def _set_up(scene: Any, samples: int, threads: int) -> None:
    """Set up Cycles on the CPU: few samples, denoised; no caustics and no fireflies."""
    scene.render.engine = "CYCLES"
    scene.render.threads_mode, scene.render.threads = "FIXED", threads
    scene.render.use_persistent_data = True
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.image_settings.color_depth = "32"
    cycles = scene.cycles
    cycles.device, cycles.samples = "CPU", samples
    cycles.use_adaptive_sampling = False
    cycles.max_bounces, cycles.diffuse_bounces, cycles.glossy_bounces = 6, 4, 4
    cycles.caustics_reflective = cycles.caustics_refractive = False
    cycles.sample_clamp_indirect = 5.0
    cycles.use_denoising = True


def _materials(room: dict[str, np.ndarray], folder: Path) -> list[Any]:
    """Return one Principled shader per pair of gloss and emission, all coloured by one texture image."""
    file = folder / "atlas.png"
    file.write_bytes(room["atlas_png"].tobytes())
    image = bpy.data.images.load(str(file))
    return [
        _material(image, float(gloss), float(emission))
        for gloss, emission in zip(room["gloss"], room["emission"], strict=True)
    ]


def _material(image: Any, gloss: float, emission: float) -> Any:
    """Return a material: chalk (gloss 0) over varnish to tinted mirror (gloss 1), as in our renderer."""
    material = bpy.data.materials.new("surface")
    material.use_nodes = True
    nodes, links = material.node_tree.nodes, material.node_tree.links
    nodes.clear()
    texture, shader, output = (
        nodes.new(kind)
        for kind in ("ShaderNodeTexImage", "ShaderNodeBsdfPrincipled", "ShaderNodeOutputMaterial")
    )
    texture.image = image
    inputs = shader.inputs
    mirror = 0.0 if emission > 0.0 else gloss
    inputs["Metallic"].default_value = mirror**2
    inputs["Roughness"].default_value = 0.55 * (1.0 - mirror)
    inputs["Specular IOR Level"].default_value = min(0.5, 5.0 * mirror)
    inputs["Emission Strength"].default_value = emission
    links.new(texture.outputs["Color"], inputs["Base Color"])
    if emission > 0.0:
        links.new(texture.outputs["Color"], inputs["Emission Color"])
    links.new(shader.outputs["BSDF"], output.inputs["Surface"])
    return material


def _mesh(name: str, room: dict[str, np.ndarray], materials: list[Any], chosen: np.ndarray) -> Any:
    """Return an object of the chosen triangles, shaded with the normals at their corners."""
    corners_m = room["corners_m"][chosen]
    count = len(corners_m)
    mesh = bpy.data.meshes.new(name)
    mesh.vertices.add(3 * count)
    mesh.vertices.foreach_set("co", corners_m.ravel())
    mesh.loops.add(3 * count)
    mesh.loops.foreach_set("vertex_index", np.arange(3 * count, dtype=np.int32))
    mesh.polygons.add(count)
    mesh.polygons.foreach_set("loop_start", np.arange(0, 3 * count, 3, dtype=np.int32))
    mesh.polygons.foreach_set("material_index", room["material"][chosen].astype(np.int32))
    layer = mesh.uv_layers.new(name="atlas")
    layer.data.foreach_set("uv", room["uv"][chosen].ravel())
    for material in materials:
        mesh.materials.append(material)
    mesh.update(calc_edges=True)
    mesh.normals_split_custom_set(room["corner_normals"][chosen].reshape(-1, 3))
    thing = bpy.data.objects.new(name, mesh)
    bpy.context.collection.objects.link(thing)
    return thing


def _lights(room: dict[str, np.ndarray]) -> None:
    """Add glowing balls that light objects and are reflected by them, but are invisible themselves."""
    values = zip(room["light_position_m"], room["light_color"], room["light_size_m"], strict=True)
    for position_m, color, size_m in values:
        strongest = max(float(color.max()), 1e-9)
        light = bpy.data.lights.new("lamp", "POINT")
        light.color = color / strongest
        # A white surface at 1 m has the radiance W / (4 pi^2), which should be the light's intensity.
        light.energy = 4.0 * np.pi**2 * strongest
        light.shadow_soft_size = float(size_m)
        thing = bpy.data.objects.new("lamp", light)
        thing.location = position_m
        thing.visible_camera = False
        bpy.context.collection.objects.link(thing)


def _ambient(color: np.ndarray) -> None:
    """Add the sky outside and, in closed rooms, the same light without its colour from all directions.

    Blender adds it at every bounce to points with nothing within 1.2 m above them; if surfaces reflect half
    of the light, the sum is twice the light that our own renderer adds once.
    """
    scene = bpy.context.scene
    scene.world = world = bpy.data.worlds.new("ambient")
    world.use_nodes = True
    background = next(node for node in world.node_tree.nodes if node.type == "BACKGROUND")
    background.inputs["Color"].default_value = (*color, 1.0)
    world.cycles_visibility.diffuse = False
    world.light_settings.distance = 1.2
    world.light_settings.ao_factor = 0.5 * float(color.mean())
    scene.cycles.use_fast_gi, scene.cycles.fast_gi_method = True, "ADD"


def _pictures(room: dict[str, np.ndarray], folder: Path) -> list[np.ndarray]:
    """Return (H, W, 3) float16 light for each camera."""
    scene = bpy.context.scene
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    bpy.context.collection.objects.link(camera)
    scene.camera = camera
    pictures = []
    for view, (matrix, T_world_camera) in enumerate(zip(room["matrix"], room["T_world_camera"], strict=True)):
        _point(scene, camera, matrix, T_world_camera, room["size_px"])
        scene.cycles.seed = view
        file = folder / f"{view}.exr"
        scene.render.filepath = str(file)
        bpy.ops.render.render(write_still=True)
        pictures.append(_light(file))
    return pictures


def _point(
    scene: Any, camera: Any, matrix: np.ndarray, T_world_camera: np.ndarray, size_px: np.ndarray
) -> None:
    """Set Blender's camera, which looks along -z with y up and has its shift in widths of the image."""
    width, height = (int(n) for n in size_px)
    fx, fy, cx, cy = matrix[0, 0], matrix[1, 1], matrix[0, 2], matrix[1, 2]
    scene.render.resolution_x, scene.render.resolution_y = width, height
    scene.render.resolution_percentage = 100
    # Pixels are not square if fx and fy differ; Blender requires both aspects to be at least 1.
    scene.render.pixel_aspect_x, scene.render.pixel_aspect_y = max(1.0, fy / fx), max(1.0, fx / fy)
    optics = camera.data
    optics.sensor_fit, optics.sensor_width = "HORIZONTAL", _SENSOR_MM
    optics.lens = float(fx / width * _SENSOR_MM)
    optics.shift_x = float((0.5 * (width - 1) - cx) / width)
    optics.shift_y = float((cy - 0.5 * (height - 1)) / width * fx / fy)
    optics.clip_start, optics.clip_end = 0.01, 1000.0
    camera.matrix_world = Matrix((T_world_camera @ np.diag([1.0, -1.0, -1.0, 1.0])).tolist())


def _light(file: Path) -> np.ndarray:
    """Return (H, W, 3) float16 light of a rendered file; Blender stores rows from the bottom up."""
    image = bpy.data.images.load(str(file))
    width, height = image.size
    values = np.empty(width * height * 4, np.float32)
    image.pixels.foreach_get(values)
    bpy.data.images.remove(image)
    return np.clip(values.reshape(height, width, 4)[::-1, :, :3], 0.0, _BRIGHTEST).astype(np.float16)


if __name__ == "__main__":
    main()
