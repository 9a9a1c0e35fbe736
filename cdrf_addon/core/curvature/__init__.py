# SPDX-License-Identifier: GPL-3.0-or-later
"""From a mesh to its curvature, at each vertex and at the lengths light diffuses over."""
