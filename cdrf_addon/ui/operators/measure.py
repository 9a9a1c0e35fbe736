# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators that path-trace spheres of a material: Measure makes a table of them, Fit fits sigma0.

The path tracing runs in a Blender of its own (measuring/process.py), so the window stays alive and
nothing is changed before the end. Measurements are kept on disk and used again.
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
from ...blender.material.install import cdrf_node
from ...blender.material.model import has_colour, kind_of_model, set_kind, set_model
from ...blender.material.scatter_distance import channel_sigma0, set_channel_sigma0
from ...blender.material.scattering import Scattering, read_scattering
from ...blender.material.settings import is_view_dependent
from ...blender.material.walk import rescale_free_path
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
from ...measuring.cache import cache_folder
from ...measuring.picture import make_picture, picture_path, show_picture
from ...measuring.process import POLL_SECONDS, measure_steps
from ...measuring.request import DEFAULT_QUALITY, RANDOM_WALK, Request
from .shared import OnTranslucentMaterial, StepByStep, refuse, warn_if_overridden

Colour = tuple[float, float, float]
# Cycles cannot measure an albedo of 0.
LEAST_ALBEDO = 1e-3
# Greatest difference of the principal curvatures of a sphere, relative to its curvedness. They
# differ on a cylinder, whose curvature is constant, too.
ROUND = 1e-2
MOST_RADIUS = 1e6
# Scatter radius times curvature that the picture shows of a flat object.
MIDDLE_SCALE = 0.25
QUALITY_ITEMS = (
    ("preview", "Preview", "A quarter of the default's time; for a first look"),
    ("default", "Default", "About a minute on two cores"),
    ("fine", "Fine", "Half the noise of the default, in four times its time"),
)


class _PathTraced(OnTranslucentMaterial, StepByStep):
    """Measures the active material behind a progress bar; never registered itself."""

    # Another process path-traces: the artist goes on working.
    WHILE_WAITING = "PASS_THROUGH"
    _material_uid: int
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
        material = self.material(context)
        self._fill_in(material)
        return context.window_manager.invoke_props_dialog(self, width=360)

    def _fill_in(self, material: bpy.types.Material) -> None:
        """Take the properties that nobody has set from the material."""
        own = own_scattering(material)
        for name in ("albedo", "radius", "method"):
            if not self.properties.is_property_set(name):
                setattr(self, name, getattr(own, name))

    def draw(self, _context: bpy.types.Context) -> None:
        layout = self.layout
        layout.use_property_split = True
        for name in self.SETTINGS:
            layout.prop(self, name)

    def execute(self, context: bpy.types.Context) -> set[str]:
        material = self.material(context)
        self._fill_in(material)
        self._material_uid = material.session_uid
        known = context.object.data.cdrf
        self._kappa = known.median
        kappa, k1, k2, _ = known.mean_values
        self._round = known.kind == CONSTANT and abs(k1 - k2) <= ROUND * kappa
        try:
            self._steps = self._work(self._request())
            if context.window is None or bpy.app.background:
                return self.finish(context, run_steps(self._steps))
        except CdrfError as error:
            return refuse(self, error)
        return self.begin(context)

    def _request(self) -> Request:
        if not 0.0 < max(self.radius) <= MOST_RADIUS:
            raise ParameterError(
                f"The scatter radius must be above 0, up to {MOST_RADIUS:g}, in at least one "
                "colour: enter one."
            )
        red, green, blue = (max(float(part), LEAST_ALBEDO) for part in self.albedo)
        return Request((red, green, blue), self.quality, self.seed, method=self.method)

    def _material_of_job(self) -> bpy.types.Material:
        """Return the material that the work began with.

        Raises:
            SceneError: It was deleted or made opaque meanwhile.
        """
        for material in bpy.data.materials:
            if material.session_uid == self._material_uid and cdrf_node(material) is not None:
                return material
        raise SceneError(
            "The material was deleted or is no longer translucent. The measurement is kept: press "
            "the button again on a material with the same settings to use it at once."
        )

    def _work(self, request: Request) -> Generator[tuple[float, str], None, Any]:
        """Path-trace, then compute the result that `finish` writes."""
        raise NotImplementedError


def own_scattering(material: bpy.types.Material) -> Scattering:
    """Read a material's scattering from its nodes, else compute it from its scatter distance."""
    found = read_scattering(material)
    if found is not None:
        # Burley's profile is not path-traced; it approximates a random walk.
        return replace(found, method=RANDOM_WALK) if found.method == BURLEY else found
    node = cdrf_node(material)
    assert node is not None
    red, green, blue, _ = node.inputs[ids.BASE_COLOR].default_value
    albedo = (red, green, blue)
    sigma0 = channel_sigma0(material)
    factors = sigma0_per_radius(albedo, walk_method(RANDOM_WALK))
    radius = [float(own / factor) for own, factor in zip(sigma0, factors, strict=True)]
    return Scattering(albedo, (radius[0], radius[1], radius[2]), RANDOM_WALK, 1.0)


def _smooth_and_fit(
    spheres: SphereMeasurement, radius: Colour
) -> tuple[MeasuredModel, MaterialFit]:
    fitted = fit_material(spheres)
    # The model would otherwise fit this slope once more.
    widest = fitted.channels[int(np.argmax(radius))]
    return MeasuredModel(spheres, radius, widest.sigma0["sphere"]), fitted


def _in_thread(
    call: Callable[[], Any], part: float, what: str
) -> Generator[tuple[float, str], None, Any]:
    """Compute for a second or two in a thread, so that the window stays alive.

    Args:
        call: What to compute.
        part: Progress to show meanwhile, from 0 to 1.
        what: What is being done.

    Returns:
        What the call returned.
    """
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
        keep_energy = self.energy == "KEEP" or (self.energy == "AUTO" and not self._round)
        # The energy of all views is needed to keep it.
        found = yield from measure_steps(replace(request, all_views=keep_energy), cache_folder())
        make = partial(measured_model, found, tuple(self.radius), keep_energy=keep_energy)
        return (yield from _in_thread(make, 1.0, "Smoothing"))

    def finish(self, context: bpy.types.Context, found: Any) -> set[str]:
        material = self._material_of_job()
        model, sigma0 = found
        table = ensure_table(model)
        material.cdrf.measured, material.cdrf.measured_image = table.key, table.image
        set_model(material, model.key)
        material.cdrf.sigma0 = sigma0
        material.cdrf.sigma0_ratio = (1.0, 1.0, 1.0)
        warn_if_overridden(self, material)
        self.report({"INFO"}, f"CDRF: '{material.name}' is shaded as its spheres were path-traced")
        return {"FINISHED"}


class CDRF_OT_fit(_PathTraced):
    """Path-trace spheres of this material and fit the scatter distance of each colour to them"""

    bl_idname = "cdrf.fit"
    bl_label = "Fit \u03c3\u2080"
    bl_options = {"REGISTER", "UNDO"}

    def _work(self, request: Request) -> Generator[tuple[float, str], None, Any]:
        spheres = yield from measure_steps(request, cache_folder())
        work = partial(_smooth_and_fit, spheres, tuple(self.radius))
        return (yield from _in_thread(work, 1.0, "Fitting"))

    def finish(self, context: bpy.types.Context, found: Any) -> set[str]:
        material = self._material_of_job()
        model, fitted = found
        if has_colour(material):
            set_kind(material, SPHERE)
        name = "ring" if kind_of_model(material) == RING else "sphere"
        # Exact at the object's median curvature; the picture shows that sphere.
        sigma0 = sigma0_at(fitted, name, self.radius, self._kappa)
        view_dependent = is_view_dependent(material)
        before = channel_sigma0(material)
        set_channel_sigma0(material, sigma0)
        if view_dependent:
            # The walk's own length is the node's, and not what was fitted.
            rescale_free_path(material, before, sigma0)
        warn_if_overridden(self, material)
        for sentence in fitted.sentences():
            self.report({"INFO"}, sentence)
        if view_dependent:
            self.report({"INFO"}, "CDRF: the fit shows most with View Dependence switched off")
        scale = max(self.radius) * self._kappa or MIDDLE_SCALE
        try:
            path = picture_path(material, cache_folder())
            make_picture(model, fitted, scale, path)
        except OSError as error:
            self.report(
                {"WARNING"},
                f"The picture of the fit could not be written ({error.strerror}): save the file "
                "in a folder where you may write.",
            )
            return {"FINISHED"}
        show_picture(context)
        self.report({"INFO"}, f"CDRF: picture of the fit written to {path}")
        return {"FINISHED"}


CLASSES = (CDRF_OT_measure, CDRF_OT_fit)

register, unregister = bpy.utils.register_classes_factory(CLASSES)
