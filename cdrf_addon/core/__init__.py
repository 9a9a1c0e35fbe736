# SPDX-License-Identifier: GPL-3.0-or-later
"""Pure numerics (numpy, scipy, libigl). Nothing here imports bpy; a test holds that."""
