# SPDX-License-Identifier: GPL-3.0-or-later
"""The world's light: what it is, and how it is captured."""
