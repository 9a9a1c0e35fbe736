# SPDX-License-Identifier: GPL-3.0-or-later
"""The view-dependent model (core/walk) against walks that it was not fitted to.

`./dev bench walk` fits its coefficients anew, judges those that ship, and writes
docs/results/walk.md with its figure. The coefficients of core/walk/view.py were fitted by the same
formulas and weights, to 100,000 to 200,000 walks a view of a compiled copy of the walk (numba). The
command walks less, in NumPy, so that it comes to other digits at a similar error: the nine numbers
of GAIN trade against each other. It does not reproduce the digits that ship; what anybody can check
is their error: `--judge`. Nobody has run it for longer than minutes.
"""
