# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators that path-trace spheres of a material: Measure makes a table of them, Fit fits sigma0.

The path tracing runs in a Blender of its own (measure.py), so the window stays alive and nothing is
changed before the end. What was measured once is kept on disk.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Generator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import partial
from typing import Any

import bpy
import numpy as np
from bpy.props import EnumProperty, FloatVectorProperty, IntProperty, StringProperty

from ... import ids
from ...blender.material import model as reflectance_models
from ...blender.material.install import cdrf_node
from ...blender.material.scattering import Scattering, read_scattering
from ...blender.nodes.tables import ensure_table
from ...compat import walk_method
from ...core.curvature.summary import CONSTANT
from ...core.errors import CdrfError, ParameterError, SceneError
from ...core.measured.material_fit import MaterialFit, fit_material, sigma0_at
from ...core.measured.measurement import SphereMeasurement
from ...core.measured.model import MeasuredModel, measured_model
from ...core.progress import run_steps
from ...core.reflectance.model import RING, SPHERE
from ...core.scattering.node_radius import BURLEY, sigma0_per_radius
from ...measuring.picture import make_picture, picture_path, show_picture
from ...measuring.process import (
    DEFAULT_QUALITY,
    POLL_SECONDS,
    RANDOM_WALK,
    Request,
    cache_folder,
    measure_steps,
)
from ..modal import StepByStep
from .model import OnSkin, skin_of, warn_if_overridden

Colour = tuple[float, float, float]
# Cycles has no albedo of 0 to measure.
LEAST_ALBEDO = 1e-3
# Principal curvatures of a sphere are equal; an open cylinder's are not.
ROUND = 1e-2
MOST_RADIUS = 1e6
# Shown in the picture where nothing is known of the object.
MIDDLE_SCALE = 0.25
QUALITY_ITEMS = (
    ("preview", "Preview", "A quarter of the default's time; shows which way it goes"),
    ("default", "Default", "About a minute on two cores"),
    ("fine", "Fine", "Half the noise of the default, in four times its time"),
)


class _PathTraced(OnSkin, StepByStep):
    """Measures the active material behind a progress bar; never registered itself."""

    # The path tracing is elsewhere: the artist goes on working.
    WHILE_WAITING = "PASS_THROUGH"
    _skin: int
    _kappa: float
    _round: bool
    SETTINGS: tuple[str, ...] = ("albedo", "radius", "quality", "seed")

    albedo: FloatVectorProperty(
        name="Albedo",
        description="Colour of the material in white light, taken from its nodes",
        subtype="COLOR",
        size=3,
        default=(0.8, 0.8, 0.8),
        min=0.0,
        max=1.0,
        options={"SKIP_SAVE"},
    )
    radius: FloatVectorProperty(
        name="Scatter Radius R, G, B",
        description=(
            "Radius times Scale of Blender's subsurface scattering, for red, green and blue, taken "
            "from the material's nodes; without such nodes from its scatter distance"
        ),
        unit="LENGTH",
        size=3,
        default=(0.01, 0.01, 0.01),
        min=0.0,
        precision=4,
        options={"SKIP_SAVE"},
    )
    quality: EnumProperty(
        name="Quality",
        description="How long Cycles may take, against how much noise is left",
        items=QUALITY_ITEMS,
        default=DEFAULT_QUALITY,
    )
    seed: IntProperty(
        name="Seed",
        description="Another number gives other noise of the same size",
        default=0,
        min=0,
        max=2**31 - 1,
    )

    method: StringProperty(default=RANDOM_WALK, options={"HIDDEN", "SKIP_SAVE"})

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        skin = skin_of(context)
        self._fill_in(skin)
        return context.window_manager.invoke_props_dialog(self, width=360)

    def _fill_in(self, skin: bpy.types.Material) -> None:
        """Take from the material what nobody has set."""
        own = own_scattering(skin)
        for name in ("albedo", "radius", "method"):
            if not self.properties.is_property_set(name):
                setattr(self, name, getattr(own, name))

    def draw(self, _context: bpy.types.Context) -> None:
        layout = self.layout
        layout.use_property_split = True
        for name in self.SETTINGS:
            layout.prop(self, name)

    def execute(self, context: bpy.types.Context) -> set[str]:
        skin = skin_of(context)
        self._fill_in(skin)
        self._skin = skin.session_uid
        known = context.object.data.cdrf
        self._kappa = known.median
        kappa, k1, k2, _ = known.mean_values
        self._round = known.kind == CONSTANT and abs(k1 - k2) <= ROUND * kappa
        try:
            self._steps = self._work(self._request())
            if context.window is None or bpy.app.background:
                return self.finish(context, run_steps(self._steps))
        except CdrfError as error:
            return self.refuse(error)
        return self.begin(context)

    def _request(self) -> Request:
        if not 0.0 < max(self.radius) <= MOST_RADIUS:
            raise ParameterError(
                f"A scatter radius above 0, up to {MOST_RADIUS:g}, is wanted: enter one."
            )
        red, green, blue = (max(float(part), LEAST_ALBEDO) for part in self.albedo)
        return Request((red, green, blue), self.quality, self.seed, method=self.method)

    def _material(self) -> bpy.types.Material:
        """Return the material the work began with, which may have gone meanwhile."""
        for skin in bpy.data.materials:
            if skin.session_uid == self._skin and cdrf_node(skin) is not None:
                return skin
        raise SceneError(
            "The material is no longer there or no longer translucent; the measurement is kept, "
            "so the next one of the same material is done at once."
        )

    def _work(self, request: Request) -> Generator[tuple[float, str], None, Any]:
        """Path-trace, then work out what this operator is after."""
        raise NotImplementedError


def own_scattering(skin: bpy.types.Material) -> Scattering:
    """Read a material's scattering from its nodes, else work it out from its scatter distance."""
    found = read_scattering(skin)
    if found is not None:
        # Burley's profile is no path tracing: what it stands for is a random walk.
        return replace(found, method=RANDOM_WALK) if found.method == BURLEY else found
    node = cdrf_node(skin)
    assert node is not None
    red, green, blue, _ = node.inputs[ids.BASE_COLOR].default_value
    albedo = (red, green, blue)
    sigma0 = reflectance_models.channel_sigma0(skin)
    factors = sigma0_per_radius(albedo, walk_method(RANDOM_WALK))
    radius = [float(own / factor) for own, factor in zip(sigma0, factors, strict=True)]
    return Scattering(albedo, (radius[0], radius[1], radius[2]), RANDOM_WALK, 1.0)


def _smooth_and_fit(
    spheres: SphereMeasurement, radius: Colour
) -> tuple[MeasuredModel, MaterialFit]:
    fitted = fit_material(spheres)
    # The slope that the model would otherwise fit once more.
    widest = fitted.channels[int(np.argmax(radius))]
    return MeasuredModel(spheres, radius, widest.sigma0["sphere"]), fitted


def _aside(
    call: Callable[[], Any], part: float, what: str
) -> Generator[tuple[float, str], None, Any]:
    """Do a second or two of arithmetic in a thread, so that the window stays alive."""
    with ThreadPoolExecutor(1) as pool:
        running = pool.submit(call)
        while not running.done():
            yield part, what
            time.sleep(POLL_SECONDS)
    return running.result()


class CDRF_OT_measure(_PathTraced):
    """Path-trace spheres of this material and shade it with what they show; a minute, once"""

    bl_idname = "cdrf.measure"
    bl_label = "Measure"
    bl_options = {"REGISTER", "UNDO"}

    energy: EnumProperty(
        name="Energy",
        description=(
            "A sphere that scatters far is up to a third brighter than an opaque one: light that "
            "leaves one place arrives at another. A head is not"
        ),
        items=(
            ("AUTO", "Auto", "As measured on spheres, kept on everything else"),
            (
                "KEEP",
                "Keep",
                "As bright as an opaque surface, spheres seen from all sides; closest on heads",
            ),
            (
                "MEASURED",
                "As Measured",
                "As bright as a sphere lit from the side; exact on such spheres",
            ),
        ),
        default="AUTO",
    )
    SETTINGS = ("albedo", "radius", "quality", "seed", "energy")

    def _work(self, request: Request) -> Generator[tuple[float, str], None, Any]:
        kept = self.energy == "KEEP" or (self.energy == "AUTO" and not self._round)
        # What is to be seen from anywhere is measured from everywhere.
        found = yield from measure_steps(replace(request, all_views=kept), cache_folder())
        make = partial(measured_model, found, tuple(self.radius), keep_energy=kept)
        return (yield from _aside(make, 1.0, "Smoothing"))

    def finish(self, context: bpy.types.Context, found: Any) -> set[str]:
        skin = self._material()
        model, sigma0 = found
        table = ensure_table(model)
        skin.cdrf.measured, skin.cdrf.measured_image = table.key, table.image
        reflectance_models.set_model(skin, model.key)
        skin.cdrf.sigma0 = sigma0
        skin.cdrf.sigma0_ratio = (1.0, 1.0, 1.0)
        warn_if_overridden(self, skin)
        self.report({"INFO"}, f"CDRF: '{skin.name}' is shaded as its spheres were path-traced")
        return {"FINISHED"}


class CDRF_OT_fit(_PathTraced):
    """Path-trace spheres of this material and fit the scatter distance of each colour to them"""

    bl_idname = "cdrf.fit"
    bl_label = "Fit \u03c3\u2080"
    bl_options = {"REGISTER", "UNDO"}

    def _work(self, request: Request) -> Generator[tuple[float, str], None, Any]:
        spheres = yield from measure_steps(request, cache_folder())
        work = partial(_smooth_and_fit, spheres, tuple(self.radius))
        return (yield from _aside(work, 1.0, "Fitting"))

    def finish(self, context: bpy.types.Context, found: Any) -> set[str]:
        skin = self._material()
        model, fitted = found
        if reflectance_models.has_colour(skin):
            reflectance_models.set_kind(skin, SPHERE)
        name = "ring" if reflectance_models.kind_of_model(skin) == RING else "sphere"
        # Right at the object's middle curvature; that sphere is shown, too.
        sigma0 = sigma0_at(fitted, name, self.radius, self._kappa)
        reflectance_models.set_channel_sigma0(skin, sigma0)
        warn_if_overridden(self, skin)
        for sentence in fitted.sentences():
            self.report({"INFO"}, sentence)
        scale = max(self.radius) * self._kappa or MIDDLE_SCALE
        try:
            path = picture_path(skin, cache_folder())
            make_picture(model, fitted, scale, path)
        except OSError as error:
            self.report({"WARNING"}, f"The picture could not be written: {error.strerror}.")
            return {"FINISHED"}
        show_picture(context)
        self.report({"INFO"}, f"CDRF: picture of the fit written to {path}")
        return {"FINISHED"}


CLASSES = (CDRF_OT_measure, CDRF_OT_fit)

register, unregister = bpy.utils.register_classes_factory(CLASSES)
