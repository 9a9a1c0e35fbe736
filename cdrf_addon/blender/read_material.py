# SPDX-License-Identifier: GPL-3.0-or-later
"""What a material already says of its subsurface scattering: a Principled or Subsurface node.

Blender has no shader that scatters differently over a surface in our sense, so an albedo that comes
from a picture is read as the picture's mean.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import bpy
import numpy as np

from .. import ids
from ..compat import uses_nodes

Colour = tuple[float, float, float]
# Pixels of a picture that are looked at for its mean.
MOST_PIXELS = 250_000


@dataclass(frozen=True)
class Scattering:
    """Subsurface scattering as Blender's nodes describe it."""

    albedo: Colour
    radius: Colour
    """Radius times scale of each channel, in the scene's units."""
    method: str
    """Blender's name: RANDOM_WALK, RANDOM_WALK_SKIN or BURLEY."""
    weight: float
    """Part of the surface that scatters; 1 for a Subsurface Scattering node."""
    notes: tuple[str, ...] = ()
    """What could not be read as it is, a sentence each."""


def read_scattering(material: bpy.types.Material) -> Scattering | None:
    """Read the scattering of the material's own surface; None if nothing in it scatters.

    The first node counts that feeds the material's output, our own nodes left aside.
    """
    if not uses_nodes(material):
        return None
    outputs = [
        node
        for node in material.node_tree.nodes
        if node.type == "OUTPUT_MATERIAL" and node.get(ids.ROLE_KEY) != ids.ROLE_OUTPUT
    ]
    outputs.sort(key=lambda node: (node.is_active_output, node.target == "ALL"), reverse=True)
    pending = [output.inputs["Surface"] for output in outputs]
    seen = set()
    while pending:
        socket = pending.pop(0)
        if not socket.is_linked:
            continue
        node = socket.links[0].from_node
        if node.name in seen:
            continue
        seen.add(node.name)
        found = _of_node(node)
        if found is not None:
            return found
        pending += [item for item in node.inputs if item.type == "SHADER"]
    return None


def _of_node(node: bpy.types.ShaderNode) -> Scattering | None:
    notes: list[str] = []
    if node.type == "BSDF_PRINCIPLED":
        weight = _number(node, "Subsurface Weight", notes)
        if not weight > 0.0:
            return None
        method = node.subsurface_method
        albedo = _colour(node, "Base Color", notes)
        scale = _number(node, "Subsurface Scale", notes)
        radius = _vector(node, "Subsurface Radius", notes)
    elif node.type == "SUBSURFACE_SCATTERING":
        weight = 1.0
        method = node.falloff
        albedo = _colour(node, "Color", notes)
        scale = _number(node, "Scale", notes)
        radius = _vector(node, "Radius", notes)
    else:
        return None
    lengths = [max(part * scale, 0.0) for part in radius]
    if not max(lengths) > 0.0:
        return None
    if weight < 1.0:
        notes.append(
            f"Only {weight:.0%} of '{node.name}' scatters; CDRF takes the whole surface as if it "
            "did, so lower the scatter distance if that is too much."
        )
    return Scattering(albedo, (lengths[0], lengths[1], lengths[2]), method, weight, tuple(notes))


def _number(node: bpy.types.ShaderNode, name: str, notes: list[str]) -> float:
    return float(_value(node, name, notes))


def _vector(node: bpy.types.ShaderNode, name: str, notes: list[str]) -> Colour:
    x, y, z = _value(node, name, notes)
    return float(x), float(y), float(z)


def _value(node: bpy.types.ShaderNode, name: str, notes: list[str]) -> Any:
    """Read an input, through plain value nodes and reroutes; a texture leaves the socket's own."""
    socket = node.inputs[name]
    source = _source(socket)
    if source is not None:
        if source.node.type in {"VALUE", "RGB"}:
            return _plain(source)
        notes.append(f"{name} comes from '{source.node.name}'; its plain value was taken instead.")
    return _plain(socket)


def _colour(node: bpy.types.ShaderNode, name: str, notes: list[str]) -> Any:
    socket = node.inputs[name]
    source = _source(socket)
    if source is None:
        return _plain(socket)
    if source.node.type == "RGB":
        return _plain(source)
    image = getattr(source.node, "image", None) if source.node.type == "TEX_IMAGE" else None
    mean = _mean(image)
    if mean is None:
        notes.append(f"{name} comes from '{source.node.name}'; its plain value was taken instead.")
        return _plain(socket)
    notes.append(f"{name} comes from a picture; its mean colour was taken.")
    return mean


def _source(socket: bpy.types.NodeSocket) -> bpy.types.NodeSocket | None:
    """Return the output that feeds a socket, or None."""
    for _ in range(64):
        if not socket.is_linked:
            return None
        found = socket.links[0].from_socket
        if found.node.type != "REROUTE":
            return found
        socket = found.node.inputs[0]
    return None


def _plain(socket: bpy.types.NodeSocket) -> Any:
    """Value of a socket: a number, or the first three of several."""
    value = socket.default_value
    return float(value) if isinstance(value, float | int) else tuple(float(v) for v in value)[:3]


def _mean(image: bpy.types.Image | None) -> Colour | None:
    """Mean colour of a picture, linear; None if it cannot be read."""
    if image is None or (not image.has_data and image.source not in {"FILE", "GENERATED"}):
        return None
    width, height = image.size
    if not width * height or not image.channels >= 3:
        return None
    flat = np.empty(width * height * image.channels, dtype=np.float32)
    image.pixels.foreach_get(flat)
    pixels = flat.reshape(-1, image.channels)
    pixels = pixels[:: max(1, len(pixels) // MOST_PIXELS)]
    solid = pixels[:, 3] > 0.0 if image.channels > 3 else np.ones(len(pixels), dtype=bool)
    with np.errstate(over="ignore"):
        values = np.clip(np.nan_to_num(pixels[solid, :3].astype(np.float64)), 0.0, 1.0)
    if not len(values):
        return None
    # Pixels come as they are stored: 8-bit pictures are display-referred.
    if image.colorspace_settings.name == "sRGB":
        values = np.where(values <= 0.04045, values / 12.92, ((values + 0.055) / 1.055) ** 2.4)
    red, green, blue = values.mean(axis=0)
    return float(red), float(green), float(blue)
