# SPDX-License-Identifier: GPL-3.0-or-later
"""Install, use, disable and uninstall the extension in one Blender; print a report as JSON.

usage: python install_cycle.py ZIP PROFILE_DIR, with BLENDER_USER_RESOURCES=PROFILE_DIR

It runs in a process of its own, because bpy reads the profile on import and because neither the
checkout nor the environment's own igl and scipy may be used.
"""

import importlib
import json
import runpy
import sys
from collections.abc import Callable
from importlib.abc import MetaPathFinder
from importlib.machinery import ModuleSpec, PathFinder
from pathlib import Path

MODULE = "bl_ext.user_default.cdrf"
BUNDLED = ("igl", "scipy")


class OnlyFromProfile(MetaPathFinder):
    """Finds the bundled packages in the profile and nowhere else."""

    def __init__(self, profile: Path) -> None:
        self.profile = profile

    def find_spec(self, fullname, path=None, target=None) -> ModuleSpec | None:
        if fullname not in BUNDLED:
            return None
        folders = [entry for entry in sys.path if self.profile in Path(entry).resolve().parents]
        spec = PathFinder.find_spec(fullname, folders)
        if spec is None:
            raise ModuleNotFoundError(f"{fullname} is not in {folders}", name=fullname)
        return spec


zip_file, profile_dir = (Path(argument).resolve() for argument in sys.argv[1:])
sys.meta_path.insert(0, OnlyFromProfile(profile_dir))

import bpy  # noqa: E402  (only after the finder is in place)


def is_ours(value: object) -> bool:
    return str(getattr(value, "__module__", "")).startswith((MODULE, "cdrf_addon"))


def traces() -> list[str]:
    """Everything that an add-on can register with Blender, as sorted names."""
    found = [f"type {name}" for name in dir(bpy.types)]
    found += [f"operators {name}" for name in dir(bpy.ops)]
    for name in dir(bpy.types):
        kind = getattr(bpy.types, name)
        draw = getattr(kind, "draw", None)
        found += [f"drawn in {name}" for f in getattr(draw, "_draw_funcs", ()) if is_ours(f)]
        properties = kind.bl_rna.properties if hasattr(kind, "bl_rna") else {}
        found += [f"property {name}.{key}" for key in properties.keys()]  # noqa: SIM118 (bpy)
    for name in dir(bpy.app.handlers):
        handlers = getattr(bpy.app.handlers, name)
        if isinstance(handlers, list):
            found += [f"handler {name} {f.__name__}" for f in handlers if is_ours(f)]
    return sorted(found)


def our_functions() -> list[Callable[..., object]]:
    """Every function of the enabled extension; Blender does not list its timers."""
    modules = [module for name, module in sys.modules.items() if name.startswith(MODULE)]
    return [
        value
        for module in modules
        for value in vars(module).values()
        if callable(value) and is_ours(value)
    ]


def main_job() -> dict[str, object]:
    """Translucency for one torus, as an artist's script asks for it."""
    bpy.ops.mesh.primitive_torus_add()
    torus = bpy.context.object
    torus.select_set(True)
    result = bpy.ops.cdrf.setup()
    attribute = torus.data.attributes.get("cdrf_curvature")
    return {
        "result": sorted(result),
        "attribute": attribute and [attribute.data_type, attribute.domain],
        "groups": [group.name for group in bpy.data.node_groups],
    }


def measured_file() -> str:
    """Where a measurement is kept: of a few small spheres, path-traced as an artist's are."""
    request = importlib.import_module(f"{MODULE}.cdrf_addon.measuring.request")
    process = importlib.import_module(f"{MODULE}.cdrf_addon.measuring.process")
    cache = importlib.import_module(f"{MODULE}.cdrf_addon.measuring.cache")
    request.QUALITIES["preview"] = request.Quality((24, 8), 1, 2)
    folder = cache.cache_folder()
    process.measure(request.Request((0.8, 0.5, 0.4), "preview", scales=(0.1, 1.0)), folder)
    (file,) = folder.glob("*.npz")
    return str(file)


def doors() -> dict[str, object]:
    """Run the installed extension's command files as Blender does; report whose code they use."""
    folder = Path(sys.modules[f"{MODULE}.cdrf_addon"].__file__ or "").parent
    names = ("batch_render", "fit")
    mains = [runpy.run_path(str(folder / f"{name}.py"))["main"] for name in names]
    out = profile_dir / "batch"
    code = mains[0]([str(profile_dir / "absent.obj"), "--output", str(out)])
    return {
        "packages": [main.__module__ for main in mains],
        "copies": [name for name in sys.modules if name.partition(".")[0] == "cdrf_addon"],
        "code": code,
        "summary": json.loads((out / "summary.json").read_text()),
    }


def bundled_files() -> dict[str, str]:
    """Where the bundled packages come from, once they are imported."""
    return {name: str(__import__(name).__file__) for name in BUNDLED}


def enabled() -> bool:
    # A failed register() leaves the add-on listed but not enabled.
    listed = MODULE in bpy.context.preferences.addons
    return listed and getattr(sys.modules[MODULE], "__addon_enabled__", False)


def repo_index() -> int:
    repos = bpy.context.preferences.extensions.repos
    return next(i for i, repo in enumerate(repos) if repo.module == "user_default")


report: dict[str, object] = {}
before = traces()
bpy.ops.extensions.package_install_files(
    filepath=str(zip_file), repo="user_default", enable_on_install=True
)
report["enabled"] = enabled()
report["job"] = main_job()
report["measured"] = measured_file()
report["doors"] = doors()
report["bundled"] = bundled_files()
functions = our_functions()

bpy.ops.preferences.addon_disable(module=MODULE)
report["enabled after disable"] = enabled()
bpy.ops.preferences.addon_enable(module=MODULE)
report["enabled again"] = enabled()
functions += our_functions()
bpy.ops.preferences.addon_disable(module=MODULE)
report["left by disable"] = sorted(set(traces()) - set(before))
report["timers"] = [repr(f) for f in functions if bpy.app.timers.is_registered(f)]

bpy.ops.extensions.package_uninstall(repo_index=repo_index(), pkg_id="cdrf")
report["left by uninstall"] = sorted(
    str(path.relative_to(profile_dir))
    for path in profile_dir.rglob("*")
    if path.is_file() and {"cdrf", *BUNDLED} & set(path.parts)
)
print(json.dumps(report))
