# SPDX-License-Identifier: GPL-3.0-or-later
"""From what a material is made of to its scatter distance."""
