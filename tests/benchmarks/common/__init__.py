# SPDX-License-Identifier: GPL-3.0-or-later
"""What several benchmarks share: memory, times, shapes, rays, draws, tables, files, the machine."""
