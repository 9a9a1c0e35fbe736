# SPDX-License-Identifier: GPL-3.0-or-later
"""The static node groups: as committed, built once, rebuilt when older, and in the asset file."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import bpy
import pytest
from rig import Rig

from cdrf_addon import ids
from cdrf_addon.blender.nodes import lights

FOLDER = Path(__file__).resolve().parents[2] / "node_groups"


@pytest.mark.smoke
def test_wiring_is_as_committed() -> None:
    """On failure: ./dev python node_groups/build.py writes the new wiring, to be reviewed."""
    command = [sys.executable, str(FOLDER / "build.py"), "--check"]
    result = subprocess.run(command, capture_output=True, text=True, check=False, timeout=120)
    assert result.returncode == 0, result.stdout


def test_asset_file_holds_the_groups(rig: Rig) -> None:
    with bpy.data.libraries.load(str(FOLDER / "cdrf.blend"), assets_only=True) as (source, wanted):
        assert {"CDRF Sun", "CDRF Reflectance Sphere RGB"} <= set(source.node_groups)
        wanted.node_groups = ["CDRF Reflectance Sphere RGB"]
    group = wanted.node_groups[0]
    texture = next(node for node in group.nodes if node.type == "TEX_IMAGE")
    assert texture.image.packed_file is not None and texture.image.is_float


def test_groups_are_reused_and_older_ones_rebuilt_in_place(rig: Rig) -> None:
    first = lights.sun_group()
    first.name = "Renamed by the artist"
    assert lights.sun_group() == first
    count = len(first.nodes)
    first.nodes.clear()
    first[ids.VERSION_KEY] = lights.VERSION - 1
    assert lights.sun_group() == first
    assert len(first.nodes) == count
    assert len(first.interface.items_tree) == 7


def test_a_foreign_group_of_the_same_name_is_left_alone(rig: Rig) -> None:
    foreign = bpy.data.node_groups.new("CDRF Sun", "ShaderNodeTree")
    ours = lights.sun_group()
    assert ours != foreign and not foreign.nodes
