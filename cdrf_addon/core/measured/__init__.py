# SPDX-License-Identifier: GPL-3.0-or-later
"""Reflectance taken from path-traced spheres, and fits to it."""
