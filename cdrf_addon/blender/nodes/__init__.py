# SPDX-License-Identifier: GPL-3.0-or-later
"""Building blocks of node trees; nothing here knows a scene or a material."""
