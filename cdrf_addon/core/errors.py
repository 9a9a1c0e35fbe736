# SPDX-License-Identifier: GPL-3.0-or-later
"""Errors whose text is a sentence an artist can act on."""


class CdrfError(Exception):
    """Base of every error the extension raises on purpose; its text is shown to the artist."""


class ParameterError(CdrfError):
    """A number is outside the range in which the theory means anything."""


class MeshError(CdrfError):
    """A mesh has nothing from which curvature can be computed."""


class SceneError(CdrfError):
    """The scene, object or material is not in a state the operation can work on."""


class DependencyError(CdrfError):
    """A library the extension needs is not installed."""


class MeasurementError(CdrfError):
    """A measurement of path-traced spheres could not be made, read or used."""
