# SPDX-License-Identifier: GPL-3.0-or-later
"""Every name that is written into a .blend or that a script may rely on, once."""

from typing import Final

# --- stable for artists' scripts (README, "For scripts") ---------------------------------------
CURVATURE_ATTRIBUTE: Final = "cdrf_curvature"
"""FLOAT_COLOR point attribute: kappa, k1, k2, signed mean, per world unit."""

# --- node groups and images: all start with CDRF ------------------------------------------------
PREFIX: Final = "CDRF"
LUT_IMAGE: Final = "CDRF Reflectance Table"
NODE: Final = "CDRF"
OUTPUT_NODE: Final = "CDRF Output"
DISPLAY_NODE: Final = "CDRF Curvature Display"

# Custom properties by which the extension knows its own data again, whatever its name by then.
ROLE_KEY: Final = "cdrf_role"
VERSION_KEY: Final = "cdrf_version"
CHANNELS_KEY: Final = "cdrf_channels"
SOURCE_KEY: Final = "cdrf_curvature_source"
SCENE_KEY: Final = "cdrf_scene"
LIGHT_KEY: Final = "cdrf_light_kind"
SCALE_KEY: Final = "cdrf_curvature_scale"
"""On an object: size of the mesh as measured / size of this object, where objects share a mesh."""

ROLE_SHADER: Final = "shader"
ROLE_DISPLAY: Final = "display"
ROLE_REFLECTANCE: Final = "reflectance"
ROLE_LUT: Final = "lut"
ROLE_OUTPUT: Final = "output"
ROLE_ALPHA: Final = "alpha"
ROLE_TRANSPARENT: Final = "transparent"
ROLE_DISPLAY_PART: Final = "display part"

# --- sockets ------------------------------------------------------------------------------------
BASE_COLOR: Final = "Base Color"
SIGMA0: Final = "Sigma0"
SIGMA0_RATIO: Final = "Sigma0 Ratio"
NORMAL: Final = "Normal"
STRENGTH: Final = "Strength"
CURVATURE: Final = "Curvature"
SHADER: Final = "Shader"

COSINE: Final = "Cosine"
VARIANCE: Final = "Variance"
REFLECTANCE: Final = "Reflectance"

POSITION: Final = "Position"
AXIS_X: Final = "Axis X"
AXIS_Y: Final = "Axis Y"
AXIS_Z: Final = "Axis Z"
POWER: Final = "Power"
DIRECTION: Final = "Direction"
RADIANCE: Final = "Radiance"
SIN2_HALF_ANGLE: Final = "Squared Sine of Half Angle"
RADIUS: Final = "Radius"
SOFT_FALLOFF: Final = "Soft Falloff"
INVERSE_RANGE2: Final = "Inverse Squared Range"
CONE_COSINE: Final = "Cone Cosine"
CONE_SHARPNESS: Final = "Cone Sharpness"
HALF_X: Final = "Half X"
HALF_Y: Final = "Half Y"
NORMALIZE: Final = "Normalize"
MINIMUM: Final = "Minimum"
MAXIMUM: Final = "Maximum"
