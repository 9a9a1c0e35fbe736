# SPDX-License-Identifier: GPL-3.0-or-later
"""Subsurface scattering as a material's Principled or Subsurface Scattering node describes it.

Blender has no shader that scatters differently over a surface in our sense, so an albedo that comes
from a picture is read as the picture's mean.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import bpy
import numpy as np

from ... import ids
from ...compat import uses_nodes, walk_method
from ...core.scattering.node_radius import SKIN
from ...core.walk.material import DEFAULT_WALK, MaterialWalk
from ..pictures import linear_from_srgb, pixels_of

Colour = tuple[float, float, float]
# Pixels of a picture that make up its mean.
MOST_PIXELS = 250_000
# How Blender makes one number of a colour (Rec. 709).
LUMINANCE = (0.2126, 0.7152, 0.0722)


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
    walk: MaterialWalk = DEFAULT_WALK
    """How light walks under the surface."""
    notes: tuple[str, ...] = ()
    """What could not be read as it is; a sentence each, for the artist."""
    walk_notes: tuple[str, ...] = ()
    """The same of what only the walk depends on."""

    def notes_for(self, view_dependent: bool) -> tuple[str, ...]:
        """Return what an artist should know whose surface depends on the view, or does not."""
        return self.notes + (self.walk_notes if view_dependent else ())


def read_scattering(material: bpy.types.Material) -> Scattering | None:
    """Read the scattering of the material's own surface; None if nothing in it scatters.

    The first such node that feeds the material's output counts, through mixes and node groups; our
    own nodes do not.
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
        source = _source(pending.pop(0))
        if source is None or source.node.mute or source in seen:
            continue
        seen.add(source)
        found = _of_node(source.node)
        if found is not None:
            return found
        pending += _shaders_of(source)
    return None


def _shaders_of(source: bpy.types.NodeSocket) -> list[bpy.types.NodeSocket]:
    """Return the inputs that feed a shader output: of a mix those that show, of a group inside."""
    node = source.node
    if node.type == "GROUP" and node.node_tree is not None:
        return [
            socket
            for inner in node.node_tree.nodes
            if inner.type == "GROUP_OUTPUT" and inner.is_active_output
            for socket in inner.inputs
            if socket.identifier == source.identifier
        ]
    shaders = [socket for socket in node.inputs if socket.type == "SHADER"]
    if node.type == "MIX_SHADER" and not node.inputs[0].is_linked:
        share = node.inputs[0].default_value
        if share <= 0.0 or share >= 1.0:
            return shaders[:1] if share <= 0.0 else shaders[1:]
    return shaders


def _of_node(node: bpy.types.ShaderNode) -> Scattering | None:
    notes: list[str] = []
    if node.type == "BSDF_PRINCIPLED":
        weight = _number(node, "Subsurface Weight", notes)
        if _source(node.inputs["Subsurface Weight"]) is not None and notes:
            weight = 1.0
            notes = [f"Subsurface Weight of '{node.name}' varies; it was taken as 1."]
        unseen = max(_number(node, name, []) for name in ("Metallic", "Transmission Weight"))
        weight *= max(1.0 - unseen, 0.0)
        if not weight > 0.0:
            return None
        method = node.subsurface_method
        names = ("Base Color", "Subsurface Scale", "Subsurface Radius", "Subsurface Anisotropy")
    elif node.type == "SUBSURFACE_SCATTERING":
        weight = 1.0
        method = node.falloff
        names = ("Color", "Scale", "Radius", "Anisotropy")
    else:
        return None
    albedo = _colour(node, names[0], notes)
    scale = _number(node, names[1], notes)
    lengths = [max(part * scale, 0.0) for part in _vector(node, names[2], notes)]
    if not (max(lengths) > 0.0 and np.isfinite(lengths).all()):
        return None
    if weight < 1.0:
        notes.append(
            f"Only {weight:.0%} of '{node.name}' scatters; CDRF takes the whole surface as if it "
            "did, so lower the scatter distance if that is too much."
        )
    radius = (lengths[0], lengths[1], lengths[2])
    unread: list[str] = []
    walk = _walk(node, walk_method(method), names[3], unread)
    return Scattering(albedo, radius, method, weight, walk, tuple(notes), tuple(unread))


def _walk(
    node: bpy.types.ShaderNode, method: str, anisotropy: str, notes: list[str]
) -> MaterialWalk:
    """Read roughness, index and anisotropy; a node without an input has Blender's default."""

    def number(name: str, usual: float) -> float:
        known = name in node.inputs and node.inputs[name].enabled
        return _number(node, name, notes) if known else usual

    # The skin variant enters as through a rough surface, whatever the node's roughness.
    roughness = 1.0 if method == SKIN else number("Roughness", 1.0)
    # Cycles takes the square of the Principled BSDF's roughness, and the other node's as it is.
    alpha = roughness**2 if node.type == "BSDF_PRINCIPLED" else roughness
    index = "Subsurface IOR" if method == SKIN else "IOR"
    return MaterialWalk(method, alpha, number(index, 1.4), number(anisotropy, 0.0))


def _number(node: bpy.types.ShaderNode, name: str, notes: list[str]) -> float:
    parts = _value(node, name, notes)
    return parts[0] if len(parts) == 1 else float(np.dot(parts[:3], LUMINANCE))


def _vector(node: bpy.types.ShaderNode, name: str, notes: list[str]) -> Colour:
    parts = _value(node, name, notes)
    return (parts[0],) * 3 if len(parts) < 3 else (parts[0], parts[1], parts[2])


def _value(node: bpy.types.ShaderNode, name: str, notes: list[str]) -> list[float]:
    """Read an input through value nodes and reroutes; with a texture, the socket's own value."""
    socket = node.inputs[name]
    source = _source(socket)
    if source is not None:
        if source.node.type in {"VALUE", "RGB"}:
            return _plain(source)
        notes.append(f"{name} comes from '{source.node.name}'; its plain value was taken instead.")
    return _plain(socket)


def _colour(node: bpy.types.ShaderNode, name: str, notes: list[str]) -> Colour:
    source = _source(node.inputs[name])
    if source is not None and source.node.type == "TEX_IMAGE" and source.name == "Color":
        mean = _mean(source.node.image)
        if mean is not None:
            notes.append(f"{name} comes from a picture; its mean colour was taken.")
            return mean
    return _vector(node, name, notes)


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


def _plain(socket: bpy.types.NodeSocket) -> list[float]:
    """Return the value of a socket: one number, or the three of a vector or colour."""
    value: Any = socket.default_value
    return [float(value)] if isinstance(value, float | int) else [float(v) for v in value][:3]


def _mean(image: bpy.types.Image | None) -> Colour | None:
    """Return the mean colour of a picture, linear; None if it cannot be read."""
    if image is None or (not image.has_data and image.source not in {"FILE", "GENERATED"}):
        return None
    width, height = image.size
    if not width * height or not image.channels >= 3:
        return None
    pixels = pixels_of(image).reshape(-1, image.channels)
    pixels = pixels[:: max(1, len(pixels) // MOST_PIXELS)]
    solid = pixels[:, 3] > 0.0 if image.channels > 3 else np.ones(len(pixels), dtype=bool)
    with np.errstate(over="ignore"):
        values = np.clip(np.nan_to_num(pixels[solid, :3].astype(np.float64)), 0.0, 1.0)
    if not len(values):
        return None
    # Pixels come as they are stored: 8-bit pictures are display-referred.
    if image.colorspace_settings.name == "sRGB":
        values = linear_from_srgb(values)
    red, green, blue = values.mean(axis=0)
    return float(red), float(green), float(blue)
