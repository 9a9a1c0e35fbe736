# SPDX-License-Identifier: GPL-3.0-or-later
"""Materials: translucency in and out, without harm to the artist's own nodes."""
