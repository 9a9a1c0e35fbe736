# SPDX-License-Identifier: GPL-3.0-or-later
"""The node group of a scene: its lights, world and shadows wired to the look-ups."""
