# SPDX-License-Identifier: GPL-3.0-or-later
"""Reflectance measured on path-traced spheres, fits to it, and the model made of it."""
