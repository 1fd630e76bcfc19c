"""The six mount parameters: as people list them, and their order in every vector and covariance."""


PARAMETERS = (  # as people list them: name, place among the six (rotation about body x, y, z, lever arm), setting, unit
    ("roll", 1, "roll_deg", "deg"),
    ("pitch", 0, "pitch_deg", "deg"),
    ("yaw", 2, "yaw_deg", "deg"),
    ("x", 3, "x_m", "m"),
    ("y", 4, "y_m", "m"),
    ("z", 5, "z_m", "m"),
)


SETTINGS = tuple(key for *_, key, _ in PARAMETERS)
