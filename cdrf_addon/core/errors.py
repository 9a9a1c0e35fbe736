# SPDX-License-Identifier: GPL-3.0-or-later
"""Errors whose text is a sentence an artist can act on."""


class CdrfError(Exception):
    """Base of every error that the extension raises on purpose; the artist reads its text."""


class ParameterError(CdrfError):
    """A number is outside the range for which the theory is defined."""


class MeshError(CdrfError):
    """A mesh has nothing from which curvature can be computed."""


class SceneError(CdrfError):
    """The scene, object or material is not in a state that the operation can work on."""


class DependencyError(CdrfError):
    """A library the extension needs is not installed."""


class MeasurementError(CdrfError):
    """A measurement of path-traced spheres could not be made, read or used."""
