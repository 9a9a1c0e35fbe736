# SPDX-License-Identifier: GPL-3.0-or-later
"""The two-dimensional look-up table of a reflectance model, and the mapping of its axes.

Columns: q = sign(c) sqrt|c| of c = cos theta, dense at the terminator where f bends.
Rows:    w = (variance / VARIANCE_MAX)^(1/4) = sqrt(sigma / SIGMA_MAX), dense at small sigma.

The shader reads the image through Blender's *tube* projection, the one that samples without mip
levels (decision 002). There (sin p, cos p, v) has u = (1 - p / pi) / 2,
so p = pi K q with K slightly under 1 keeps clear of the seam. K and the row offset put the ends of
both axes on texel centres, where bilinear filtering is exact.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ..errors import ParameterError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from .model import Model

# From here on the ring differs from its limit 1/pi by less than exp(-SIGMA_MAX^2 / 2) / 2 = 1.9e-6,
# the sphere from 1/4 by less than exp(-SIGMA_MAX^2) / 2 = 7e-12.
SIGMA_MAX = 5.0
VARIANCE_MAX = SIGMA_MAX**2
# Texels left free between the seam of the tube and the ends of the cosine axis.
SEAM_TEXELS = 3


@dataclass(frozen=True)
class LutLayout:
    """Size of the table in texels and the affine maps from axis to texture coordinate.

    Raises:
        ParameterError: The table is too small to hold an axis and its margin.
    """

    width: int = 192
    height: int = 192

    def __post_init__(self) -> None:
        if self.width < 4 * SEAM_TEXELS or self.height < 2:
            raise ParameterError(
                f"A look-up table of {self.width} x {self.height} texels is too small; "
                f"{4 * SEAM_TEXELS} x 2 is the least."
            )

    @property
    def seam_factor(self) -> float:
        """K: the part of the tube's circumference that the cosine axis covers."""
        return 1.0 - (2.0 * SEAM_TEXELS + 1.0) / self.width

    @property
    def row_offset(self) -> float:
        """Texture coordinate v of sigma = 0, the centre of the first row."""
        return 0.5 / self.height

    @property
    def row_scale(self) -> float:
        """Extent in v from sigma = 0 to SIGMA_MAX, centre of the last row."""
        return (self.height - 1.0) / self.height


DEFAULT_LAYOUT = LutLayout()


def cosine_axis(layout: LutLayout = DEFAULT_LAYOUT) -> NDArray[np.float64]:
    """Cosine of theta at each texel column, shape (width,); clipped to [-1, 1] in the margins."""
    u = (np.arange(layout.width) + 0.5) / layout.width
    q = np.clip((1.0 - 2.0 * u) / layout.seam_factor, -1.0, 1.0)
    return np.asarray(np.sign(q) * q**2)


def sigma_axis(layout: LutLayout = DEFAULT_LAYOUT) -> NDArray[np.float64]:
    """Standard deviation sigma at each texel row in radians, shape (height,)."""
    w = np.arange(layout.height) / (layout.height - 1.0)
    return np.asarray(SIGMA_MAX * w**2)


def build_lut(model: Model, layout: LutLayout = DEFAULT_LAYOUT) -> NDArray[np.float32]:
    """Tabulate a model, row 0 at sigma = 0; float64 until it is stored.

    Returns:
        (height, width), and where the model has colour (height, width, 3).
    """
    theta = np.arccos(cosine_axis(layout))
    return model.evaluate(theta[None, :], sigma_axis(layout)[:, None]).astype(np.float32)


def sample_lut(
    table: NDArray[np.float32],
    cosine: NDArray[np.float64],
    variance: NDArray[np.float64],
    layout: LutLayout = DEFAULT_LAYOUT,
) -> NDArray[np.float64]:
    """Read the table as the shader does: same mapping, ideal bilinear filter, in float64.

    Args:
        table: From `build_lut`, (height, width) or (height, width, 3).
        cosine: cos theta in [-1, 1], any shape.
        variance: sigma^2 >= 0, broadcast against cosine.
        layout: The layout the table was built with.

    Returns:
        f interpolated, of the broadcast shape, with a last axis of 3 where the table has one.
    """
    q = np.sign(cosine) * np.sqrt(np.abs(cosine))
    u = (1.0 - layout.seam_factor * q) / 2.0
    w = np.minimum(variance / VARIANCE_MAX, 1.0) ** 0.25
    v = layout.row_offset + layout.row_scale * w
    x = np.clip(u * layout.width - 0.5, 0.0, layout.width - 1.0)
    y = np.clip(v * layout.height - 0.5, 0.0, layout.height - 1.0)
    column = np.minimum(x.astype(np.int64), layout.width - 2)
    row = np.minimum(y.astype(np.int64), layout.height - 2)
    along, up = x - column, y - row
    if table.ndim == 3:
        along, up = along[..., None], up[..., None]
    wide = table.astype(np.float64)
    lower = wide[row, column] * (1.0 - along) + wide[row, column + 1] * along
    upper = wide[row + 1, column] * (1.0 - along) + wide[row + 1, column + 1] * along
    return np.asarray(lower * (1.0 - up) + upper * up)
