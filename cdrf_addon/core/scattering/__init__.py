# SPDX-License-Identifier: GPL-3.0-or-later
"""The scatter distance sigma0 of a material: from coefficients, presets or Blender's radius."""
