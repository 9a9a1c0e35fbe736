# SPDX-License-Identifier: GPL-3.0-or-later
"""Path-traced spheres of a material: a process of its own, its cache, and the figure."""
