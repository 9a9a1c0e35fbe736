# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes cdrf.blend, the static node groups as assets, and topology.txt, their wiring as text.

    ./dev python node_groups/build.py            write both
    ./dev python node_groups/build.py --check    fail if topology.txt is not what the code builds

The extension builds the same groups by itself; the assets are for artists who wire materials by
hand (Asset Browser), the text is for reviews: a changed link is a changed line. Run it on the
oldest supported Blender (Python 3.11), as newer files do not open in older Blenders.
"""

from __future__ import annotations

import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))

import bpy  # noqa: E402  (the checkout must be importable first)

from cdrf_addon.blender.material.specular import under_specular_group  # noqa: E402
from cdrf_addon.blender.nodes.curvature import diffused_group, display_group  # noqa: E402
from cdrf_addon.blender.nodes.detail import detail_group  # noqa: E402
from cdrf_addon.blender.nodes.harmonics import bands_group, harmonics_group  # noqa: E402
from cdrf_addon.blender.nodes.lights import area_group, light_group  # noqa: E402
from cdrf_addon.blender.nodes.received import lit_group  # noqa: E402
from cdrf_addon.blender.nodes.reflectance import (  # noqa: E402
    CHANNEL_SETS,
    SEPARATE,
    reflectance_group,
)
from cdrf_addon.blender.nodes.tables import ensure_table  # noqa: E402
from cdrf_addon.blender.nodes.walk import haze_group, walk_group  # noqa: E402
from cdrf_addon.core.reflectance.model import name_of, ring, sphere  # noqa: E402
from cdrf_addon.core.reflectance.profile import profile  # noqa: E402
from cdrf_addon.core.walk.material import DEFAULT_WALK, model_of_key  # noqa: E402

ASSET_FILE = HERE / "cdrf.blend"
TOPOLOGY_FILE = HERE / "topology.txt"
PROFILE_GROUP = f"CDRF Reflectance {name_of(profile().key)} RGB"
DESCRIPTIONS = {
    "CDRF Sun": "Direction, radiance and blur of a sun for CDRF Reflectance",
    "CDRF Point": "Direction, radiance and blur of a point light for CDRF Reflectance",
    "CDRF Spot": "Direction, radiance and blur of a spot light for CDRF Reflectance",
    "CDRF Area Rectangle": "Direction, radiance and blur of an area light for CDRF Reflectance",
    "CDRF Area Ellipse": "Direction, radiance and blur of a disk light for CDRF Reflectance",
    "CDRF Reflectance Sphere RGB": "Diffusion on a sphere, one sigma for all channels",
    "CDRF Reflectance Sphere R+G+B": "Diffusion on a sphere, a sigma for each channel",
    "CDRF Reflectance Ring RGB": "f(theta, sigma) of Kubo et al. 2011, one sigma for all channels",
    "CDRF Reflectance Ring R+G+B": "f(theta, sigma) of Kubo et al. 2011, a sigma for each channel",
    PROFILE_GROUP: "f(theta, sigma) of layered skin (d'Eon and Luebke 2007) in one look-up",
    "CDRF Bands Sphere R+G+B": "What diffusion on a sphere leaves of a world's bands",
    "CDRF Harmonics": "A world's light on a surface, as nine harmonics of three colours",
    "CDRF Detail": "Part of a normal map's detail that a scatter distance leaves",
    "CDRF Under Gloss": "Part of the light that gloss lets through to the surface under it",
    "CDRF Diffused Curvature": "Curvature at the length over which a channel's light diffuses",
    "CDRF Curvature Display": "Curvature in hot colours",
    "CDRF Signed Curvature Display": "Curvature from blue hollows to red bulges",
}


def build_all() -> list[bpy.types.ShaderNodeTree]:
    """Build every static group in an empty file."""
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    built = [light_group(kind) for kind in ("SUN", "POINT", "SPOT")]
    built += [area_group(elliptic=elliptic) for elliptic in (False, True)]
    built += [
        reflectance_group(channels, ensure_table(model))
        for model in (sphere(), ring(), profile())
        for channels in CHANNEL_SETS
    ]
    built += [
        reflectance_group(SEPARATE, ensure_table(model), own_cosines=True)
        for model in (sphere(), profile())
    ]
    built += [
        bands_group(channels, ensure_table(model))
        for model, channels in (
            (sphere(), "RGB"),
            (sphere(), SEPARATE),
            (ring(), "RGB"),
            (profile(), "RGB"),
        )
    ]
    built += [harmonics_group(), detail_group(), under_specular_group()]
    built.append(diffused_group())
    walk = DEFAULT_WALK.key
    built += [walk_group(walk, model_of_key(walk), curved=curved) for curved in (False, True)]
    built.append(haze_group())
    built += [lit_group(translucent=translucent) for translucent in (False, True)]
    built += [display_group(signed=signed) for signed in (False, True)]
    return built


def describe(tree: bpy.types.ShaderNodeTree) -> str:
    """Write a tree's interface and wiring as text, one link or constant a line."""
    lines = [f"# {tree.name}"]
    for socket in tree.interface.items_tree:
        lines.append(f"{socket.in_out.lower()} {socket.name}: {socket.socket_type}")
    for node in tree.nodes:
        kind = getattr(node, "operation", "") or getattr(node, "projection", "")
        inner = f" ({node.node_tree.name})" if node.type == "GROUP" else ""
        lines.append(f"{node.name}: {node.bl_idname} {kind}{inner}".rstrip())
        for socket in node.inputs:
            if socket.is_linked:
                source = socket.links[0]
                origin = f"{source.from_node.name}.{source.from_socket.identifier}"
                lines.append(f"  {socket.identifier} <- {origin}")
            elif socket.enabled and hasattr(socket, "default_value"):
                lines.append(f"  {socket.identifier} = {_value(socket.default_value)}")
    return "\n".join(lines) + "\n"


def _value(value: object) -> str:
    if isinstance(value, int | float):
        return f"{value:.6g}"
    if isinstance(value, str):
        return value
    return "(" + ", ".join(f"{part:.6g}" for part in value) + ")"  # type: ignore[attr-defined]


def topology() -> str:
    """Describe all groups, in order of their names."""
    return "\n".join(describe(tree) for tree in sorted(build_all(), key=lambda tree: tree.name))


def write_assets() -> None:
    """Mark the groups an artist would wire by hand as assets and write them to one file."""
    built = [tree for tree in build_all() if tree.name in DESCRIPTIONS]
    for tree in built:
        tree.asset_mark()
        tree.asset_data.description = DESCRIPTIONS[tree.name]
        tree.asset_data.license = "GPL-3.0-or-later"
    bpy.data.libraries.write(str(ASSET_FILE), set(built), fake_user=True, compress=True)


def main() -> int:
    """Write or check; return the exit code."""
    text = topology()
    if "--check" in sys.argv[1:]:
        if TOPOLOGY_FILE.read_text() != text:
            print("topology.txt differs from what the code builds; run node_groups/build.py")
            return 1
        return 0
    TOPOLOGY_FILE.write_text(text)
    write_assets()
    print(f"wrote {TOPOLOGY_FILE.name} and {ASSET_FILE.name}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
