# SPDX-License-Identifier: GPL-3.0-or-later
"""What Cycles' random walk shows, as far as view, albedo and curvature decide it."""
