# SPDX-License-Identifier: GPL-3.0-or-later
"""Figures of the report, from what its stages kept."""
