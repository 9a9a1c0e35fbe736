# SPDX-License-Identifier: GPL-3.0-or-later
"""Which tests try what is stiff or extreme, and the guard in the code that holds it.

`pytest -m stability --stability FILE` runs them and writes what came out; the report makes
docs/results/stability.md of that file, so that the page reports a run, not an intention.
"""

from __future__ import annotations

import json
import time
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any


@dataclass(frozen=True)
class Extreme:
    """Cases that one test tries."""

    area: str
    test: str
    """File in tests/ and function."""
    tried: str
    held: str
    """What has come out if the test passed."""
    guard: str


SIGMA, MESHES, KAPPA = "σ: widths of the blur", "Meshes", "κ: curvature"
LIGHTS, UNITS, TABLES = "Lights and worlds", "Units and sizes", "Tables and measurements"
CLOSED = "the closed forms change over to a series; arguments are checked at the door"
CLEAN = "core/curvature welds, filters, orients and normalises before any estimate"
NODES = "nodes clamp what they divide by and what they look up"

EXTREMES = (
    Extreme(SIGMA, "core/test_ring_model.py::test_the_value_at_1001_angles",
            "ring: σ from 0 over 10⁻¹² and 10¹² to ∞, 1,001 angles",
            "within the bound of the reference", CLOSED),
    Extreme(SIGMA, "core/test_sphere_model.py::test_the_value_at_1001_angles",
            "sphere: the same, with more angles at the terminator",
            "within the bound of the reference", CLOSED),
    Extreme(SIGMA, "core/test_ring_model.py::test_nothing_warns",
            "ring: σ of 5 × 10⁻³²⁴, 10⁻³⁰⁰, 10²⁰⁰, ∞", "finite, no warning", CLOSED),
    Extreme(SIGMA, "core/test_sphere_model.py::test_nothing_warns",
            "sphere: the same", "finite, no warning", CLOSED),
    Extreme(SIGMA, "core/test_ring_model.py::test_no_blur_is_lambert_to_the_last_bit",
            "ring: σ = 0", "Lambert to the last bit", "σ = 0 has a branch of its own"),
    Extreme(SIGMA, "core/test_sphere_model.py::test_no_blur_is_lambert_to_the_last_bit",
            "sphere: σ = 0", "Lambert to the last bit", "σ = 0 has a branch of its own"),
    Extreme(SIGMA, "core/test_ring_model.py::test_endless_blur_is_one_over_pi",
            "ring: σ from 10¹² to the largest double and ∞", "1/π", "the series ends at its mean"),
    Extreme(SIGMA, "core/test_sphere_model.py::test_endless_blur_is_a_quarter_to_the_last_bit",
            "sphere: σ from 10³ to the largest double and ∞", "1/4 to the last bit",
            "the series ends at its mean"),
    Extreme(SIGMA, "core/test_sphere_model.py::test_the_mean_over_the_sphere_is_a_quarter",
            "energy over the whole sphere, σ from 0 to ∞", "1/4 for every σ",
            "the heat kernel keeps it"),
    Extreme(SIGMA, "core/test_ring_model.py::test_no_step_where_the_two_forms_meet",
            "ring: σ a last bit to each side of the change of form", "no step",
            "both forms are exact where they meet"),
    Extreme(SIGMA, "core/test_sphere_model.py::test_no_step_where_the_two_forms_meet",
            "sphere: the same", "no step", "both forms are exact where they meet"),
    Extreme(SIGMA, "core/test_ring_model.py::test_nonsense_is_refused_in_a_sentence",
            "ring: NaN, ±∞ and negative arguments", "a sentence", "core/arguments.py"),
    Extreme(SIGMA, "core/test_sphere_model.py::test_nonsense_is_refused_in_a_sentence",
            "sphere: the same", "a sentence", "core/arguments.py"),
    Extreme(SIGMA, "core/test_profile.py::test_one_gaussian_of_any_width_is_the_base",
            "profiles of one Gaussian, width 10⁻³⁰⁰ to 10³⁰", "the base model",
            "widths count as ratios only"),
    Extreme(SIGMA, "core/test_profile.py::test_no_ratio_of_widths_is_too_much",
            "profiles whose widths differ by hundreds of decades", "finite, within [0, 1]",
            "0 times ∞ is 0: what does not spread stays Lambert"),
    Extreme(SIGMA, "core/test_lut.py::test_no_variance_is_too_large",
            "look-ups far beyond the table's last σ", "the table's end",
            "the coordinate is clamped to the last row"),
    Extreme(SIGMA, "blender/test_setup.py::test_senseless_sigma0_is_clamped",
            "slider and ratio of NaN, ±∞, 10³⁰, negative", "0 or the most allowed",
            "the property's setter clamps"),
    Extreme(KAPPA, "render/test_extremes.py::test_curvature_that_is_not_a_number",
            "κ attribute of NaN, ±∞, 10³⁰, −1 at every seventh vertex, rendered",
            "finite pixels", NODES),
    Extreme(KAPPA, "render/test_extremes.py::test_curvature_at_its_ends",
            "κ of 0 and 10⁶, rendered", "Lambert, and 1/4", NODES),
    Extreme(KAPPA, "core/test_field.py::test_twice_the_size_bends_half_as_much",
            "meshes scaled by 10⁻²⁰⁰ to 10²⁰⁰", "κ scales inversely", CLEAN),
    Extreme(KAPPA, "core/test_field.py::test_moving_does_not_matter",
            "meshes up to 10⁶ units from their origin", "the same κ", CLEAN),
    Extreme(KAPPA, "core/test_field.py::test_other_radii_are_refused_in_a_sentence",
            "0, −1, 10⁹, NaN and ∞ rings", "a sentence",
            "core/curvature/field.py checks its options"),
    Extreme(KAPPA, "core/test_diffusion.py::test_needles_and_specks_stay_finite",
            "heat steps of 10⁻³ to 30 on needles and on a speck far away", "finite",
            "needles are softened, overshoots cut to the field's range"),
    Extreme(KAPPA,
            "core/test_diffusion.py::test_no_length_changes_nothing_and_an_endless_one_leaves_the_mean",
            "heat steps of length 0 and of no end", "unchanged, and the mean",
            "conjugate gradients start from the field itself"),
    Extreme(KAPPA, "core/test_field.py::test_pieces_too_small_for_a_fit",
            "pieces with fewer vertices than a fit needs", "filled in from their neighbours",
            "estimators mark where they have no value"),
    Extreme(KAPPA, "core/test_field.py::test_a_hub_of_5000_edges_is_quick",
            "a vertex with 5,000 edges", "done in seconds", "rings have a largest size"),
    Extreme(MESHES, "core/test_crash_list.py::test_no_crash_no_hang_no_nonsense",
            "each in a process of its own, with warnings as errors",
            "finite curvature or a refusal in a sentence", CLEAN),
    Extreme(MESHES, "core/test_fuzz.py::test_random_meshes",
            "random meshes, broken in random ways", "finite or refused", CLEAN),
    Extreme(MESHES, "core/test_clean.py::test_vertices_at_infinity_or_nowhere_are_left_out",
            "vertices at NaN, ∞ and −∞", "left out", CLEAN),
    Extreme(MESHES, "core/test_clean.py::test_half_of_the_faces_turned_round_still_give_one_side",
            "half of the faces turned round", "one side", CLEAN),
    Extreme(MESHES, "core/test_clean.py::test_scale_is_taken_out",
            "meshes scaled by 10⁻³⁰⁰ to 10³⁰⁰", "the same clean mesh", CLEAN),
    Extreme(MESHES, "core/test_clean.py::test_what_cannot_be_used_is_refused_in_a_sentence",
            "arrays that are no mesh", "a sentence", CLEAN),
    Extreme(MESHES, "blender/test_setup.py::test_one_bad_mesh_does_not_stop_the_others",
            "a broken mesh among good ones", "the others are done",
            "each mesh is judged by itself, nothing is written before"),
    Extreme(LIGHTS, "render/test_extremes.py::test_odd_lights_give_finite_pixels",
            "thirteen odd lights at once: at the centre, on the surface, of no size, blinding, "
            "negative, needle-thin", "finite pixels", NODES),
    Extreme(LIGHTS, "render/test_extremes.py::test_sixty_four_suns_are_as_good_as_one",
            "64 suns from one direction", "as one sun, within the film's rounding",
            "one branch a light, added in full precision"),
    Extreme(LIGHTS, "render/test_diffuse.py::test_agrees_with_the_diffuse_bsdf",
            "every light type and setting at σ₀ = 0", "EEVEE's Diffuse BSDF",
            "the radiometry of decision 3"),
    Extreme(LIGHTS, "core/test_finite_light.py::test_the_blur_stands_for_the_light",
            "lights up to half-angles of 46°", "within the stated error",
            "core/reflectance/finite_light.py"),
    Extreme(LIGHTS,
            "core/test_environment.py::test_senseless_pixels_are_black_and_shapes_are_checked",
            "worlds with pixels of NaN, ∞ and negative radiance", "black there",
            "core/reflectance/environment.py clips"),
    Extreme(LIGHTS, "core/test_environment.py::test_extremes_of_sigma",
            "a world's light at σ of 0 and ∞", "Lambert's, and its mean", "closed band factors"),
    Extreme(LIGHTS, "render/test_ambient.py::test_no_node_for_a_black_or_missing_world",
            "no world, and a black one", "no node, no error", "a world is wired only if it shines"),
    Extreme(LIGHTS, "render/test_shadows.py::test_four_lights_share_a_mask",
            "four casting lights, which no normal separates", "one shared mask, within its bound",
            "decision 11"),
    Extreme(UNITS, "blender/test_models.py::test_presets_are_millimetres_in_the_scenes_units",
            "scenes in metres, centimetres and without units", "the same millimetres",
            "presets go through the scene's unit scale"),
    Extreme(UNITS, "blender/test_setup.py::test_object_scale_is_honoured",
            "objects scaled by 2, 0.01 and −1", "κ in world units", "κ is measured at world size"),
    Extreme(UNITS, "blender/test_setup.py::test_small_values_reach_the_shader_unsnapped",
            "tiny σ₀ and κ", "not rounded to 0", "sockets without a least value"),
    Extreme(UNITS, "core/test_dipole.py::test_impossible_media_are_refused_in_a_sentence",
            "scattering coefficients of 0, −1, NaN, ∞", "a sentence", "core/scattering/dipole.py"),
    Extreme(TABLES, "core/test_measured_model.py::test_finite_and_never_negative",
            "measured tables at every σ, 0 and ∞ included", "finite, never negative",
            "rows end where nothing changes any more"),
    Extreme(TABLES, "core/test_measurement.py::test_foreign_and_broken_files_are_refused",
            "damaged and foreign files", "a sentence, and measured again",
            "core/measured/measurement.py"),
    Extreme(TABLES, "core/test_measurement.py::test_impossible_measurements_are_refused",
            "measurements that hold NaN or impossible values", "a sentence",
            "core/measured/measurement.py"),
    Extreme(TABLES, "blender/test_measuring.py::test_a_deleted_measured_table_is_said",
            "a measured table deleted from the file", "the sphere model, and a sentence",
            "the default stands in"),
)  # fmt: skip


def by_test() -> dict[str, Extreme]:
    """Entries by file and function."""
    return {extreme.test: extreme for extreme in EXTREMES}


class Collector:
    """Gathers what came out of the marked tests of a run."""

    def __init__(self, tests: Path) -> None:
        self._tests = tests
        self._found: dict[str, dict[str, Any]] = {}

    def entry(self, nodeid: str, path: Path) -> Extreme | None:
        """Entry of a test item, or None."""
        function = nodeid.rpartition("::")[2].partition("[")[0]
        return by_test().get(f"{path.relative_to(self._tests).as_posix()}::{function}")

    def add(self, extreme: Extreme, nodeid: str, outcome: str, seconds: float, values: str) -> None:
        """Note one case."""
        row = self._found.setdefault(extreme.test, asdict(extreme) | {"cases": []})
        case = nodeid.partition("[")[2].rstrip("]")
        known = {"case": case, "outcome": outcome, "seconds": round(seconds, 2), "said": values}
        row["cases"].append(known)

    def write(self, path: Path, facts: dict[str, str]) -> None:
        """Write everything as JSON."""
        ordered = [self._found[one.test] for one in EXTREMES if one.test in self._found]
        missing = [one.test for one in EXTREMES if one.test not in self._found]
        results = {"date": time.strftime("%Y-%m-%d"), "machine": facts, "tests": ordered,
                "not run": missing}  # fmt: skip
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(json.dumps(results, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
