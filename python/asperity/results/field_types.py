"""The names of the fields that a snapshot may contain.

Written by `tools/make_types.py` from the program's table of the fields.
"""

NORMAL_FIELDS = (
    "pressure",
    "gap",
    "displacement_z",
    "contact",
    "road_height",
)

TANGENTIAL_FIELDS = (
    "traction_x",
    "traction_y",
    "displacement_x",
    "displacement_y",
    "slip_x",
    "slip_y",
)
