# SPDX-License-Identifier: GPL-3.0-or-later
"""Curvature in colours, in the viewport and as a picture."""
