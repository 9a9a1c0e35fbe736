# SPDX-License-Identifier: GPL-3.0-or-later
"""Render all pictures of one input of the batch."""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

import bpy

from .. import ids
from ..blender.display import legend
from ..blender.material.install import cdrf_node
from ..blender.material.translucent import translucent_materials_of
from ..blender.pictures import render_to, side_by_side
from ..core.errors import CdrfError, SceneError
from .batch_job import SceneJob, Shot
from .batch_journal import note_done, settings_key
from .batch_scene import prepare, translucent_materials
from .batch_summary import PictureRecord, SceneRecord
from .console import print_line


def render_scene(job: SceneJob) -> SceneRecord:
    """Render all pictures of one input; never raises for what is wrong with the input."""
    record = SceneRecord(str(job.path))
    try:
        if not job.path.exists():
            raise SceneError(f"{job.path} does not exist.")
        _SceneRenderer(job, record).render()
        record.state = "done"
    except CdrfError as error:
        record.state, record.error = "failed", str(error)
    except (RuntimeError, OSError, ValueError, KeyError, AttributeError, TypeError) as error:
        # The edge of the batch: whatever a scene does to Blender, the next one still renders.
        record.state, record.error = "failed", f"{type(error).__name__}: {str(error).strip()}"
    return record


class _SceneRenderer:
    """Renders the pictures of one input and enters them in its record and in the journal.

    Attributes:
        job: The input.
        record: What has become of it so far.
        key: Hash of the settings, of the file as it is before it is opened.
        own: sigma0 of each material as in the file, by its name.
    """

    def __init__(self, job: SceneJob, record: SceneRecord) -> None:
        self.job, self.record = job, record
        self.key = settings_key(job.path, job.options)
        self.own: dict[str, float] = {}

    def render(self) -> None:
        """Open the file and render, unless an earlier run has made every picture.

        Raises:
            CdrfError: The file cannot be used, or a picture cannot be written.
        """
        planned = self.job.planned()
        if planned and all(self._is_made(target) for target in planned):
            for target in planned:
                self._enter_earlier(target)
            return
        prepare(self.job, self.record)
        self.own = {material.name: material.cdrf.sigma0 for material in translucent_materials()}
        if self.job.options.curvature:
            self._render_curvature(self.job.options.curvature)
        self._render_frames()
        if self.job.options.save_blend:
            _set_sigma0(self.own)
            saved = self.job.saved_blend.resolve()
            bpy.ops.wm.save_as_mainfile(filepath=str(saved), copy=True)

    def _is_made(self, target: Path) -> bool:
        return self.job.is_made(target, self.key)

    def _enter_earlier(self, target: Path) -> None:
        self.record.images.append(PictureRecord(str(target), self.key, resumed=True))

    def _enter(self, picture: PictureRecord) -> None:
        self.record.images.append(picture)
        note_done(self.job.options.output, Path(picture.path), self.key)

    def _render_curvature(self, quantity: str) -> None:
        """Render the first frame's curvature, at the first sigma0 of the command line."""
        target, first = self.job.curvature_picture, self.job.sigma0s[0]
        if self._is_made(target):
            self._enter_earlier(target)
            return
        if first is not None:
            _set_sigma0(dict.fromkeys(self.own, first))
        start = time.perf_counter()
        materials = translucent_materials_of(bpy.context.view_layer)
        if not materials:
            self.record.warnings.append("Nothing here has a curvature to show.")
            return
        with self.record.stage("render curvature"):
            legend.render_curvature(bpy.context.scene, materials, target, quantity)
        seconds = round(time.perf_counter() - start, 3)
        self._enter(PictureRecord(str(target), self.key, seconds))
        print_line(f"  {target.name}")

    def _render_frames(self) -> None:
        """Render the pictures of all frames that are not there yet."""
        scene = bpy.context.scene
        frames = self.job.options.frames or (scene.frame_current,)
        number, total = 0, len(frames) * len(self.job.sigma0s)
        for frame in frames:
            scene.frame_set(frame)
            for offset, shot in enumerate(self.job.shots(frame)):
                number += 1
                if self._is_made(shot.target):
                    print_line(f"  [{number}/{total}] {shot.target.name} is there already")
                    self._enter_earlier(shot.target)
                    continue
                # The frame's first picture makes the one without scattering anew.
                picture = self._render_shot(shot, reuse=offset > 0 and shot.lambert.exists())
                self._enter(picture)
                print_line(f"  [{number}/{total}] {shot.target.name} in {picture.seconds:.1f} s")

    def _render_shot(self, shot: Shot, *, reuse: bool) -> PictureRecord:
        """Render one picture; beside it, if asked for, the one without scattering or its reuse."""
        start = time.perf_counter()
        lambert = self.job.options.lambert
        if lambert and not reuse:
            with self.record.stage("render Lambert"), without_scattering():
                render_to(shot.lambert)
        with self.record.stage("render CDRF"):
            if shot.sigma0 is not None:
                _set_sigma0(dict.fromkeys(self.own, shot.sigma0))
            render_to(shot.target)
        if lambert:
            with self.record.stage("join"):
                side_by_side(shot.lambert, shot.target, shot.side_by_side)
        return PictureRecord(
            str(shot.target),
            self.key,
            round(time.perf_counter() - start, 3),
            frame=shot.frame,
            sigma0=shot.sigma0,
            lambert=str(shot.lambert) if lambert else None,
            side_by_side=str(shot.side_by_side) if lambert else None,
        )


@contextmanager
def without_scattering() -> Iterator[None]:
    """Make every surface Lambert inside the block: sigma0 times a ratio of zero.

    The ratio goes to the socket, so that no other node group is chosen, and Sigma0 may be animated.
    """
    sockets = []
    for material in translucent_materials():
        node = cdrf_node(material)
        assert node is not None
        sockets.append((node.inputs[ids.SIGMA0_RATIO], material.cdrf.sigma0_ratio[:]))
    try:
        for socket, _ in sockets:
            socket.default_value = (0.0, 0.0, 0.0)
        yield
    finally:
        for socket, ratio in sockets:
            socket.default_value = ratio


def _set_sigma0(values: Mapping[str, float]) -> None:
    for name, value in values.items():
        bpy.data.materials[name].cdrf.sigma0 = value
