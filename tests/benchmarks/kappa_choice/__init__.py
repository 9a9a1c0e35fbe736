# SPDX-License-Identifier: GPL-3.0-or-later
"""Which curvature, diffused over which length: docs/results/kappa_choice.md.

    ./dev bench kappa_choice                         everything
    ./dev bench kappa_choice --only interpolation    one part, or several
    ./dev bench kappa_choice --only                  the page from the JSON

Everything takes about an hour on two cores, half of it path tracing; renders are kept in the
folder given by --cache and used again. No EEVEE is involved: every pixel's normal and curvature are
interpolated from the vertices in NumPy, and the reflectance is evaluated there, so that only the
choice of the curvature shows.
"""
