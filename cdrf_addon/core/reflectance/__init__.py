# SPDX-License-Identifier: GPL-3.0-or-later
"""Reflectance of curved translucent surfaces, as functions and as look-up tables."""
