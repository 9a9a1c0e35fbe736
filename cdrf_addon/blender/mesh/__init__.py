# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes: the evaluated surface in, curvature attributes out."""
