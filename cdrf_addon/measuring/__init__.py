# SPDX-License-Identifier: GPL-3.0-or-later
"""Measure spheres by path tracing in a Blender of their own, keep the tables, and draw the fits."""
