# SPDX-License-Identifier: GPL-3.0-or-later
"""The lights of a scene, and the drivers that follow them."""
