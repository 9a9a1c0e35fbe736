# SPDX-License-Identifier: GPL-3.0-or-later
"""Lengths of edges, counted by hand."""

import numpy as np

from cdrf_addon.core.curvature.topology import edge_lengths


def test_lengths_of_edges() -> None:
    lengths = edge_lengths(np.array([(0.0, 0, 0), (3, 0, 0), (3, 4, 0)]), np.array([(0, 1, 2)]))
    assert lengths.tolist() == [[3.0], [4.0], [5.0]]
