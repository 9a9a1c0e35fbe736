# SPDX-License-Identifier: GPL-3.0-or-later
"""The light of a world: read, fingerprinted, captured, and noted on shader groups."""
