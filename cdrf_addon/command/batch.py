# SPDX-License-Identifier: GPL-3.0-or-later
"""Render scenes and mesh files with CDRF, without a window.

    python -m cdrf_addon.batch_render head.obj shot.blend --sigma0 0.002 0.005 --output out
    blender --background --python cdrf_addon/batch_render.py -- shot.blend --frames 1-100

Several inputs run in a process each, so that one that crashes Blender takes nothing with it. A run
that was broken off goes on where it stopped. The exit code is 0 if every picture was made.
"""

from __future__ import annotations

import argparse
import atexit
import hashlib
import json
import math
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import bpy

from cdrf_addon import compat, register, unregister
from cdrf_addon.blender import setup, stage
from cdrf_addon.blender.display import curvature as display
from cdrf_addon.blender.display import legend
from cdrf_addon.blender.material import model as reflectance_models
from cdrf_addon.blender.material.install import cdrf_node
from cdrf_addon.command.console import own_arguments, say
from cdrf_addon.core.curvature.estimators import DEFAULT_METHOD, DEFAULT_RADIUS, METHODS
from cdrf_addon.core.curvature.field import Options
from cdrf_addon.core.errors import CdrfError, ParameterError, SceneError
from cdrf_addon.core.progress import in_words
from cdrf_addon.core.reflectance.model import MODEL_ITEMS
from cdrf_addon.core.scattering.presets import PRESETS

VERSION = 1
# Longer work than this says how far it is.
PROGRESS_SECONDS = 0.5
JOURNAL = "pictures.tsv"
DEMO_MESH = Path(__file__).resolve().parents[2] / "tests" / "data" / "human_head.obj"
# The head's unit is the decimetre; skin's colours and the reach of its red, green and blue.
DEMO = {
    "scale": 0.1,
    "subdivide": 2,
    "sigma0": [0.003],
    "ratio": [1.0, 0.35, 0.2],
    "albedo": [0.8, 0.56, 0.45],
    "resolution": (480, 640),
    "samples": 16,
    "lambert": True,
}
SCENE_KINDS = (".blend", *stage.MESH_IMPORTERS)


@dataclass
class SceneRecord:
    """What became of one input; an entry of the JSON summary."""

    input: str
    state: str = "started"
    error: str = ""
    warnings: list[str] = field(default_factory=list)
    seconds: dict[str, float] = field(default_factory=dict)
    vertices: int = 0
    images: list[dict[str, Any]] = field(default_factory=list)

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Add the time spent inside to a stage of this scene."""
        start = time.perf_counter()
        try:
            yield
        finally:
            spent = time.perf_counter() - start
            self.seconds[name] = round(self.seconds.get(name, 0.0) + spent, 4)


# --- arguments --------------------------------------------------------------------------------


def parse_frames(text: str) -> list[int]:
    """Read "7", "1-5", "1-9:2" or a comma-separated list of those.

    Raises:
        argparse.ArgumentTypeError: The text is none of them.
    """
    frames: list[int] = []
    try:
        for part in text.split(","):
            span, _, step = part.partition(":")
            # A leading minus is a negative frame, not a span.
            first, dash, last = span[1:].partition("-")
            start = int(span[:1] + first)
            frames += range(start, (int(last) if dash else start) + 1, int(step or 1))
    except ValueError as error:
        raise argparse.ArgumentTypeError(
            f"'{text}' is no list of frames; write 7, 1-5, 1-9:2 or 1,4,8"
        ) from error
    if not frames:
        raise argparse.ArgumentTypeError(f"'{text}' holds no frame; the first must be the smaller")
    return frames


def parse_resolution(text: str) -> tuple[int, int]:
    """Read "512" or "640x480".

    Raises:
        argparse.ArgumentTypeError: Not one or two whole numbers from 4 to 65536.
    """
    parts = text.lower().split("x")
    try:
        width, height = (int(part) for part in (parts * 2 if len(parts) == 1 else parts))
    except ValueError as error:
        raise argparse.ArgumentTypeError(f"'{text}' is no resolution; write 640x480") from error
    if not (4 <= width <= 65536 and 4 <= height <= 65536):
        raise argparse.ArgumentTypeError(f"'{text}' is out of range; 4 to 65536 pixels a side")
    return width, height


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError as error:
        raise argparse.ArgumentTypeError(
            f"'{text}' is no number (name the input files first, options after them)"
        ) from error


def _distance(text: str) -> float:
    value = _number(text)
    if not (math.isfinite(value) and 0.0 <= value <= 1e6):
        raise argparse.ArgumentTypeError(f"{text}: a distance from 0 to 1e6 is wanted")
    return value


def _factor(text: str) -> float:
    value = _number(text)
    if not (math.isfinite(value) and 0.0 <= value <= 1e3):
        raise argparse.ArgumentTypeError(f"{text}: a factor from 0 to 1000 is wanted")
    return value


def _size(text: str) -> float:
    value = _number(text)
    if not (math.isfinite(value) and 1e-9 <= value <= 1e9):
        raise argparse.ArgumentTypeError(f"{text}: a scale from 1e-9 to 1e9 is wanted")
    return value


def _count(low: int, high: int) -> Any:
    def read(text: str) -> int:
        value = _number(text)
        if value != int(value) or not low <= value <= high:
            raise argparse.ArgumentTypeError(f"{text}: a number from {low} to {high} is wanted")
        return int(value)

    return read


def make_parser() -> argparse.ArgumentParser:
    """Describe the command line."""
    parser = argparse.ArgumentParser(
        prog="batch_render",
        description="Render scenes and mesh files with curvature-dependent translucency in EEVEE.",
    )
    add = parser.add_argument
    add("inputs", nargs="*", type=Path, help=f"files: {', '.join(SCENE_KINDS)}")
    add("--output", type=Path, default=Path("render"), help="folder for pictures and summary.json")
    add("--sigma0", type=_distance, nargs="+", default=[], metavar="S",
        help="scatter distances in world units, a picture each (default: the file's)")  # fmt: skip
    add("--ratio", type=_factor, nargs=3, metavar=("R", "G", "B"),
        help="scatter distance of red, green, blue as factors of sigma0")  # fmt: skip
    add("--model", choices=[item[0] for item in MODEL_ITEMS],
        help="model of reflectance (default: the file's; SPHERE for mesh files)")  # fmt: skip
    add("--preset", choices=list(PRESETS), metavar="NAME",
        help=f"scatter distance of a real material: {', '.join(PRESETS)}")  # fmt: skip
    add("--albedo", type=_factor, nargs=3, metavar=("R", "G", "B"),
        help="base colour of mesh files, linear")  # fmt: skip
    add("--frames", type=parse_frames, help="7, 1-5, 1-9:2 or 1,4,8 (default: the current one)")
    add("--resolution", type=parse_resolution, help="640x480 or 512 (default: as in the file)")
    add("--samples", type=_count(1, 65536), help="EEVEE samples (default: as in the file)")
    add("--format", choices=["PNG", "EXR"], default="PNG", help="EXR is 32-bit float, linear")
    add("--lambert", action="store_true", help="also render sigma0 = 0, and both side by side")
    add("--scale", type=_size, default=1.0, help="size of mesh files: 0.1 for decimetres")
    add("--subdivide", type=_count(0, 6), default=0, help="smooth subdivisions of mesh files")
    add("--curvature", nargs="?", const="KAPPA", choices=list(display.QUANTITIES), metavar="WHAT",
        help="also render the curvature in colours, with a legend: KAPPA (as measured, the "
        "default), DIFFUSED (as rendered) or MEAN (signed)")  # fmt: skip
    add("--method", choices=list(METHODS), help="estimate curvature anew, this way")
    add(
        "--rings", type=_count(2, 10), help="rings of neighbours in the estimate (3-5: noisy scans)"
    )
    add("--save-blend", action="store_true", help="also save each prepared scene")
    add("--force", action="store_true", help="render again what is there already")
    add("--demo", action="store_true", help="the human head, Lambert beside CDRF")
    add("--worker", action="store_true", help=argparse.SUPPRESS)
    return parser


def apply_demo(options: argparse.Namespace, parser: argparse.ArgumentParser) -> None:
    """Fill in what the demo needs and the caller left open."""
    if not DEMO_MESH.exists():
        parser.error("the demo needs the project's folder; tests/data/human_head.obj is missing")
    options.inputs = [DEMO_MESH]
    for name, value in DEMO.items():
        if getattr(options, name) == parser.get_default(name):
            setattr(options, name, value)
    if options.output == parser.get_default("output"):
        options.output = Path("demo")


# --- one scene --------------------------------------------------------------------------------


def job_key(path: Path, options: argparse.Namespace) -> str:
    """Hash of all that decides a picture apart from sigma0 and frame; the resume compares it."""
    status = path.stat()
    settings = {
        name: value
        for name, value in vars(options).items()
        if name not in {"inputs", "output", "sigma0", "frames", "force", "worker", "demo"}
    }
    facts = (VERSION, str(path.resolve()), status.st_size, status.st_mtime_ns, settings)
    text = json.dumps([*facts, bpy.app.version_string], default=str, sort_keys=True)
    return hashlib.blake2b(text.encode(), digest_size=12).hexdigest()


def prepare(path: Path, options: argparse.Namespace, record: SceneRecord) -> None:
    """Load or import the scene, make it translucent or bring it up to date, and set the render.

    Raises:
        CdrfError: The file cannot be used.
    """
    if not path.exists():
        raise SceneError(f"{path} does not exist.")
    mesh_file = path.suffix.lower() != ".blend"
    with record.stage("load"):
        if mesh_file:
            bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
            stage.light_and_frame(stage.import_mesh(path, options.scale, options.subdivide))
        else:
            try:
                bpy.ops.wm.open_mainfile(filepath=str(path.resolve()), load_ui=False)
            except RuntimeError as error:
                raise SceneError(f"{path.name} cannot be opened: {str(error).strip()}") from error
    scene = bpy.context.scene
    if scene.camera is None:
        raise SceneError(f"{path.name} has no camera; add one.")
    if scene.render.engine != compat.EEVEE:
        record.warnings.append(f"The scene was set to {scene.render.engine}; rendered with EEVEE.")
        scene.render.engine = compat.EEVEE
    if options.frames:
        scene.frame_set(options.frames[0])
    if options.resolution:
        scene.render.resolution_x, scene.render.resolution_y = options.resolution
        scene.render.resolution_percentage = 100
    if options.samples:
        scene.eevee.taa_render_samples = options.samples
    output = scene.render.image_settings
    compat.set_still_format(output, "OPEN_EXR" if options.format == "EXR" else "PNG")
    output.color_depth = "32" if options.format == "EXR" else "8"
    if scene.render.use_multiview:
        record.warnings.append("The scene was set to stereo; rendered as one picture.")
        scene.render.use_multiview = False
    with record.stage("curvature and nodes"):
        _make_translucent(record, mesh_file, options)
    for material in translucent_materials():
        _adjust(material, options, mesh_file, record)


def _make_translucent(record: SceneRecord, mesh_file: bool, options: argparse.Namespace) -> None:
    layer = bpy.context.view_layer
    objects = setup.translucent_objects(layer)
    linked = sorted({m.name for item in layer.objects for m in setup.linked_skins(item)})
    if linked:
        record.warnings.append(
            f"Linked, so left as in their own file, --sigma0 or not: {', '.join(linked)}."
        )
    if not objects and not linked:
        objects = [item for item in layer.objects if item.type == "MESH" and not item.hide_render]
        if not mesh_file:
            record.warnings.append("Nothing was translucent yet: every mesh was set up.")
    if objects or not linked:
        job = setup.Setup(bpy.context, objects, options=_measurement(options))
        start = told = time.perf_counter()
        for part, what in job.steps():
            now = time.perf_counter()
            if now - told >= PROGRESS_SECONDS:
                told = now
                say(f"  {what}: {in_words(part, now - start)}")
        report = job.commit()
        record.vertices = report.vertices
        record.warnings += report.warnings


def _measurement(options: argparse.Namespace) -> Options | None:
    """How to measure curvature; None if the command line leaves that to the file."""
    if options.method is None and options.rings is None:
        return None
    return Options(options.method or DEFAULT_METHOD, options.rings or DEFAULT_RADIUS)


def _adjust(
    material: bpy.types.Material, options: argparse.Namespace, mesh_file: bool, record: SceneRecord
) -> None:
    """Set what the command line asks of a material, and take away what would override it."""
    node = cdrf_node(material)
    assert node is not None
    if display.shows_curvature(material):
        record.warnings.append(f"'{material.name}' was showing its curvature; skin is rendered.")
        display.hide([material])
    if options.preset:
        metres = reflectance_models.metres_of(bpy.context.scene)
        reflectance_models.apply_preset(material, PRESETS[options.preset], metres, 1.0)
    if options.model:
        reflectance_models.set_kind(material, options.model)
    if options.ratio:
        material.cdrf.sigma0_ratio = options.ratio
    given = options.sigma0 or options.preset
    if given and _free(material, node.inputs["Sigma0"]):
        record.warnings.append(
            f"'{material.name}': Sigma0 is animated or connected; the command line replaces that."
        )
    if options.albedo and mesh_file:
        _free(material, node.inputs["Base Color"])
        node.inputs["Base Color"].default_value = (*options.albedo, 1.0)


def _free(material: bpy.types.Material, socket: bpy.types.NodeSocket) -> bool:
    """Disconnect a socket from links, keyframes and drivers; tell whether there were any."""
    tree = material.node_tree
    links = list(socket.links)
    for link in links:
        tree.links.remove(link)
    path = socket.path_from_id("default_value")
    curves = compat.animation_curves(tree, path)
    for curve in curves:
        curve.mute = True
    return bool(links or curves)


def translucent_materials() -> list[bpy.types.Material]:
    """List the translucent materials of the open file that can be changed."""
    return [item for item in bpy.data.materials if item.is_editable and cdrf_node(item) is not None]


def render_scene(
    path: Path, stem: str, options: argparse.Namespace, done: dict[str, str]
) -> SceneRecord:
    """Render all pictures of one input; never raises for what is wrong with the input.

    Args:
        path: The file.
        stem: Start of the pictures' names, unique in this run.
        options: The command line.
        done: Key of each picture that an earlier run has made.
    """
    record = SceneRecord(str(path))
    try:
        _render_all(path, stem, options, done, record)
        record.state = "done"
    except CdrfError as error:
        record.state, record.error = "failed", str(error)
    except (RuntimeError, OSError, ValueError, KeyError, AttributeError, TypeError) as error:
        # The edge of the batch: whatever a scene does to Blender, the next one still renders.
        record.state, record.error = "failed", f"{type(error).__name__}: {str(error).strip()}"
    return record


def _render_all(
    path: Path,
    stem: str,
    options: argparse.Namespace,
    done: dict[str, str],
    record: SceneRecord,
) -> None:
    if not path.exists():
        raise SceneError(f"{path} does not exist.")
    key = job_key(path, options)
    suffix = ".exr" if options.format == "EXR" else ".png"
    sigmas: list[float | None] = list(dict.fromkeys(options.sigma0)) or [None]
    curvature = options.output / f"{stem}_curvature.png"
    if options.frames:
        planned = [
            options.output / f"{stem}_{_label(sigma)}_{frame:04d}{suffix}"
            for frame in options.frames
            for sigma in sigmas
        ]
        if options.curvature:
            planned.append(curvature)
        if all(_made(target, key, done) for target in planned) and not options.force:
            record.images = [_entry(target, key, 0.0, resumed=True) for target in planned]
            return
    prepare(path, options, record)
    scene = bpy.context.scene
    frames = options.frames or [scene.frame_current]
    own = {material.name: material.cdrf.sigma0 for material in translucent_materials()}
    if options.curvature:
        if not options.force and _made(curvature, key, done):
            record.images.append(_entry(curvature, key, 0.0, resumed=True))
        else:
            if sigmas[0] is not None:
                _set_sigma0(dict.fromkeys(own, sigmas[0]))
            _render_curvature(curvature, key, options, record)
    total = len(frames) * len(sigmas)
    for number, frame in enumerate(frames):
        scene.frame_set(frame)
        lambert = options.output / f"{stem}_lambert_{frame:04d}{suffix}"
        for offset, sigma in enumerate(sigmas):
            target = options.output / f"{stem}_{_label(sigma)}_{frame:04d}{suffix}"
            at = f"[{number * len(sigmas) + offset + 1}/{total}]"
            if not options.force and _made(target, key, done):
                say(f"  {at} {target.name} is there already")
                record.images.append(_entry(target, key, 0.0, resumed=True))
                continue
            start = time.perf_counter()
            if options.lambert and not (offset and lambert.exists()):
                with record.stage("render Lambert"), without_scattering():
                    stage.render_to(lambert)
            with record.stage("render CDRF"):
                if sigma is not None:
                    _set_sigma0(dict.fromkeys(own, sigma))
                stage.render_to(target)
            if options.lambert:
                with record.stage("join"):
                    stage.side_by_side(lambert, target, _joined(target))
            seconds = time.perf_counter() - start
            entry = _entry(target, key, seconds, resumed=False)
            entry |= {"frame": frame, "sigma0": sigma}
            if options.lambert:
                entry |= {"lambert": str(lambert), "side_by_side": str(_joined(target))}
            record.images.append(entry)
            note_done(options.output, target, key)
            say(f"  {at} {target.name} in {seconds:.1f} s")
    if options.save_blend:
        _set_sigma0(own)
        saved = options.output / f"{stem}.blend"
        bpy.ops.wm.save_as_mainfile(filepath=str(saved.resolve()), copy=True)


def _render_curvature(
    target: Path, key: str, options: argparse.Namespace, record: SceneRecord
) -> None:
    """Render the first frame's curvature, at the first sigma0 of the command line."""
    start = time.perf_counter()
    skins = setup.skins_of(bpy.context.view_layer)
    if not skins:
        record.warnings.append("Nothing here has a curvature to show.")
        return
    with record.stage("render curvature"):
        legend.render_curvature(bpy.context.scene, skins, target, options.curvature)
    record.images.append(_entry(target, key, time.perf_counter() - start, resumed=False))
    note_done(options.output, target, key)
    say(f"  {target.name}")


def _label(sigma: float | None) -> str:
    # repr tells any two numbers apart, so no picture overwrites another.
    return "cdrf" if sigma is None else f"s{sigma!r}".removesuffix(".0")


@contextmanager
def without_scattering() -> Iterator[None]:
    """Make every surface Lambert inside the block: sigma0 times a ratio of zero.

    The ratio goes to the socket, so that no other node group is chosen, and Sigma0 may be animated.
    """
    sockets = []
    for material in translucent_materials():
        node = cdrf_node(material)
        assert node is not None
        sockets.append((node.inputs["Sigma0 Ratio"], material.cdrf.sigma0_ratio[:]))
    try:
        for socket, _ in sockets:
            socket.default_value = (0.0, 0.0, 0.0)
        yield
    finally:
        for socket, ratio in sockets:
            socket.default_value = ratio


def _joined(target: Path) -> Path:
    return target.with_name(f"{target.stem}_beside_lambert{target.suffix}")


def _set_sigma0(values: dict[str, float]) -> None:
    for name, value in values.items():
        bpy.data.materials[name].cdrf.sigma0 = value


def _made(target: Path, key: str, done: dict[str, str]) -> bool:
    return done.get(str(target)) == key and target.exists() and target.stat().st_size > 0


def _entry(target: Path, key: str, seconds: float, *, resumed: bool) -> dict[str, Any]:
    return {"path": str(target), "key": key, "seconds": round(seconds, 3), "resumed": resumed}


# --- many scenes ------------------------------------------------------------------------------


def unique_stems(paths: list[Path]) -> list[str]:
    """Name the pictures of each input: its stem, numbered where two inputs share one."""
    stems: list[str] = []
    for path in paths:
        stem, number = path.stem, 2
        while stem in stems:
            stem, number = f"{path.stem}-{number}", number + 1
        stems.append(stem)
    return stems


def read_done(output: Path) -> dict[str, str]:
    """Read from the journal of earlier runs which picture was made with which settings."""
    done: dict[str, str] = {}
    try:
        lines = (output / JOURNAL).read_text().splitlines()
    except (OSError, ValueError):
        return done  # no earlier run: everything is rendered
    for line in lines:
        path, _, key = line.rpartition("\t")
        done[path] = key
    return done


def note_done(output: Path, target: Path, key: str) -> None:
    """Add a picture to the journal, at once, so that a killed run has it."""
    with (output / JOURNAL).open("a") as journal:
        journal.write(f"{target}\t{key}\n")


def write_summary(summary: Path, scenes: list[SceneRecord], seconds: float) -> None:
    """Write the JSON summary; it appears whole or not at all."""
    content = {
        "format": VERSION,
        "blender": bpy.app.version_string,
        "python": sys.version.split()[0],
        "arguments": sys.argv[1:],
        "seconds": round(seconds, 3),
        "failed": sum(scene.state == "failed" for scene in scenes),
        "scenes": [asdict(scene) for scene in scenes],
    }
    part = summary.with_suffix(".part")
    part.write_text(json.dumps(content, indent=2) + "\n")
    part.replace(summary)


def run_in_process(
    path: Path, stem: str, options: argparse.Namespace, done: dict[str, str]
) -> SceneRecord:
    """Render one input in a Blender of its own; a crash becomes a failed record."""
    with tempfile.TemporaryDirectory() as folder:
        order = Path(folder) / "order.json"
        answer = Path(folder) / "answer.json"
        settings = {k: v for k, v in vars(options).items() if k != "inputs"}
        settings |= {"input": str(path), "stem": stem, "done": done, "answer": str(answer)}
        order.write_text(json.dumps(settings, default=str))
        script = str(Path(__file__).resolve().parents[1] / "batch_render.py")
        if bpy.app.binary_path:
            head = [bpy.app.binary_path, "--background", "--python", script, "--"]
        else:
            head = [sys.executable, script]
        code = subprocess.run([*head, "--worker", str(order)], check=False).returncode
        try:
            return SceneRecord(**json.loads(answer.read_text()))
        except (OSError, ValueError, TypeError):
            return SceneRecord(
                str(path), "failed", f"Blender ended early (exit code {code}) on {path.name}."
            )


def work(order: Path) -> int:
    """Be the process of one input."""
    ensure_registered()
    settings = json.loads(order.read_text())
    path, stem, done, answer = (settings.pop(k) for k in ("input", "stem", "done", "answer"))
    options = argparse.Namespace(**settings)
    options.output = Path(options.output)
    record = render_scene(Path(path), stem, options, done)
    Path(answer).write_text(json.dumps(asdict(record)))
    return 0


def ensure_registered() -> None:
    """Register the extension unless Blender has it enabled already."""
    if hasattr(bpy.types.Material, "cdrf"):
        return
    register()
    if not bpy.app.binary_path:
        # bpy 4.5 as a module never returns from its exit while classes are registered.
        atexit.register(unregister)


def main(argv: list[str] | None = None) -> int:
    """Run the batch; return the exit code: 0, 1 if a scene failed, 2 for a wrong command line."""
    parser = make_parser()
    try:
        options = parser.parse_args(own_arguments(sys.argv) if argv is None else argv)
        if options.worker:
            return work(options.inputs[0])
        if options.demo:
            apply_demo(options, parser)
        _check(options)
    except ParameterError as error:
        say(f"batch_render: {error}")
        return 2
    except SystemExit as stop:  # argparse has printed why
        return int(stop.code or 0)
    return _run(options)


def _check(options: argparse.Namespace) -> None:
    if not options.inputs:
        raise ParameterError("no input given; name .blend or mesh files, or use --demo.")
    unknown = [str(p) for p in options.inputs if p.suffix.lower() not in SCENE_KINDS]
    if unknown:
        raise ParameterError(
            f"{', '.join(unknown)}: only {', '.join(SCENE_KINDS)} can be rendered."
        )
    try:
        options.output.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ParameterError(
            f"{options.output} cannot be made a folder: {error.strerror}."
        ) from error


def _run(options: argparse.Namespace) -> int:
    ensure_registered()
    start = time.perf_counter()
    summary = options.output / "summary.json"
    done = read_done(options.output)
    scenes: list[SceneRecord] = []
    stems = unique_stems(options.inputs)
    for number, (path, stem) in enumerate(zip(options.inputs, stems, strict=True), 1):
        say(f"({number}/{len(stems)}) {path}")
        single = len(stems) == 1
        try:
            record = (render_scene if single else run_in_process)(path, stem, options, done)
        except KeyboardInterrupt:
            scenes.append(SceneRecord(str(path), "stopped"))
            write_summary(summary, scenes, time.perf_counter() - start)
            say("Stopped. The same command goes on from here.")
            return 130
        scenes.append(record)
        for line in record.warnings:
            say(f"  note: {line}")
        if record.error:
            say(f"  FAILED: {record.error}")
        for name, seconds in record.seconds.items():
            say(f"  {name:<20} {seconds:8.2f} s")
        write_summary(summary, scenes, time.perf_counter() - start)
    failed = sum(scene.state == "failed" for scene in scenes)
    images = sum(len(scene.images) for scene in scenes)
    say(f"{images} picture(s), {failed} of {len(scenes)} scene(s) failed; see {summary}")
    for scene in scenes:
        for image in scene.images:
            if "side_by_side" in image:
                say(f"Lambert | CDRF: {image['side_by_side']}")
    return 1 if failed else 0
