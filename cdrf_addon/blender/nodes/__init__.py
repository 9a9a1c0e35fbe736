# SPDX-License-Identifier: GPL-3.0-or-later
"""Node groups that only depend on their arguments, and the builder that makes them.

Nothing here reads a scene, a light or a material.
"""
