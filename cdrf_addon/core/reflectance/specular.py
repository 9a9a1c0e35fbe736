# SPDX-License-Identifier: GPL-3.0-or-later
"""The light that a specular coat reflects, and so keeps from the diffuse surface under it.

The directional albedo of a GGX surface with Schlick's Fresnel is F0 A + B, with A and B functions
of the cosine to the viewer and the roughness alone (Karis 2013). Here they are fits of numerical
integrals over the visible normals with Smith's masking, which tests/core/test_specular.py repeats:

    A = a0 + a1 r + a2 n + a3 r n
    B = exp(b0 + r (b1 + b4 r) + n (b2 + r (b3 + b5 r) + n (b6 + b7 r)))
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

SCALE = (0.67037, 0.17919, 0.54437, -1.08798)
"""a0 to a3."""
BIAS = (0.03435, -2.53378, -3.69955, 7.16061, -1.12736, -14.74552, -8.22928, 15.72352)
"""b0 to b7."""
# Below F0 = 1 / FADE there is hardly an interface: the reflection at grazing angles fades out, too.
FADE = 100.0


def dielectric_f0(ior: ArrayLike, level: ArrayLike = 0.5) -> NDArray[np.float64]:
    """Return F0 of a Principled BSDF's IOR and Specular IOR Level."""
    eta = np.asarray(ior, dtype=np.float64)
    return np.asarray(2.0 * np.asarray(level) * ((eta - 1.0) / (eta + 1.0)) ** 2)


def specular_albedo(cosine: ArrayLike, roughness: ArrayLike, f0: ArrayLike) -> NDArray[np.float64]:
    """Return the part of the light that the specular coat reflects (Karis 2013).

    Args:
        cosine: Cosine of the angle between normal and viewer, 0 to 1.
        roughness: Roughness of Blender's nodes, 0 to 1.
        f0: Reflection at normal incidence, 0 to 1.

    Returns:
        The directional albedo, 0 to 1, of the broadcast shape.
    """
    n, r = np.asarray(cosine, dtype=np.float64), np.asarray(roughness, dtype=np.float64)
    f = np.asarray(f0, dtype=np.float64)
    a0, a1, a2, a3 = SCALE
    b0, b1, b2, b3, b4, b5, b6, b7 = BIAS
    scale = a0 + a1 * r + n * (a2 + a3 * r)
    bias = np.exp(b0 + r * (b1 + b4 * r) + n * (b2 + r * (b3 + b5 * r) + n * (b6 + b7 * r)))
    return np.asarray(np.clip(f * scale + bias * np.minimum(FADE * f, 1.0), 0.0, 1.0))
