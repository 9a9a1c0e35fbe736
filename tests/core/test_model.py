# SPDX-License-Identifier: GPL-3.0-or-later
"""The kinds of model: what each is called, and what it evaluates."""

import numpy as np
import pytest
from references import ANGLES

from cdrf_addon.core.reflectance.model import (
    DEFAULT_KIND,
    PROFILE,
    RING,
    SPHERE,
    name_of,
    ring,
    sphere,
)
from cdrf_addon.core.reflectance.profile import profile
from cdrf_addon.core.reflectance.ring_model import ring_reflectance
from cdrf_addon.core.reflectance.sphere_model import sphere_reflectance

pytestmark = pytest.mark.smoke


def test_the_kinds() -> None:
    assert DEFAULT_KIND == SPHERE
    for model, kind, evaluate in (
        (ring(), RING, ring_reflectance),
        (sphere(), SPHERE, sphere_reflectance),
    ):
        assert (model.kind, model.key, model.colour) == (kind, kind, False)
        assert model.moments == (1.0, 1.0, 1.0)
        assert np.array_equal(model.evaluate(ANGLES, 0.3), evaluate(ANGLES, 0.3))
    assert profile().kind == PROFILE
    assert profile().colour
    assert name_of(RING) == "Ring"
    assert name_of(f"{PROFILE} 0123abcd") == "Profile 0123abcd"
