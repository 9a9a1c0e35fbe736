# SPDX-License-Identifier: GPL-3.0-or-later
"""The path-traced look against two methods of Cycles: docs/results/view_dependence.md."""
