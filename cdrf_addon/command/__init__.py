# SPDX-License-Identifier: GPL-3.0-or-later
"""Command lines: the batch renderer and the fit of sigma0."""
