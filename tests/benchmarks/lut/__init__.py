# SPDX-License-Identifier: GPL-3.0-or-later
"""The look-up table in rendered EEVEE pixels: docs/results/lut.md.

    ./dev bench lut                 about five minutes on two cores
    ./dev bench lut --write-only    the page from the JSON

Every variant (size, storage, mapping of the axes, filter, projection) shades one square of a
picture. Across a square the cosine is swept, up it sigma, both crowded where f bends; the pixels
are compared with the model in float64 at the same arguments, which are rendered too, to be sure.
"""
