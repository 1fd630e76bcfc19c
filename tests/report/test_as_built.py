"""The target as found, from planes and heights worked out by hand."""

import numpy as np
import pandas as pd
import pytest

from pipeline.config.target import Letters, Origin
from pipeline.report.as_built import design_shape, deviations_from_design, measured_shape, shape_errors
from pipeline.target.design import target_of

ROOT = np.sqrt(0.5)
TARGET = Letters(a=8.0, b=3.0, c=1.0, e=0.5, origin=Origin(latitude_deg=36.0, longitude_deg=120.1, height_m=12.0))
MODEL = target_of(TARGET)
DESIGN = design_shape(MODEL)


def planes(half_width: float, corner_deg: float = 45.0) -> pd.DataFrame:
    """Normals to the vessel; P1 through (0, -half width), P3 through (0, half width), the wall at x = 0."""
    sine, cosine = np.sin(np.radians(corner_deg)), np.cos(np.radians(corner_deg))
    rows = [("P1", -ROOT, -ROOT, ROOT * half_width), ("P2", -1.0, 0.0, 0.0), ("P3", -cosine, sine, sine * half_width)]
    columns = ["plane", "normal_x_target_1", "normal_y_target_1", "distance_m"]
    table = pd.DataFrame(rows, columns=columns).assign(normal_z_target_1=0.0, sensor="laser", count=100, rms_m=0.005)
    table["pass"] = -1
    others = {f"centroid_{axis}_target_m": 0.0 for axis in "xyz"}
    table = table.assign(**others, eigenvalues_m2=[[0.0, 1.0, 1.0]] * 3, tangents=[[0.0] * 6] * 3)
    table = table.assign(covariance=[[0.0] * 9] * 3)
    astray = table.assign(distance_m=table["distance_m"] + 0.5)
    return pd.concat([table, astray.assign(sensor="mbes"), astray.assign(**{"pass": 0})], ignore_index=True)


def heights(share: float) -> pd.DataFrame:
    """The laser's residuals (measured - design height) on two tops and a bottom of blocks higher by a share."""
    design = np.array([0.5, 1.5, 2.0])
    names = [face.name for face in MODEL.faces]
    numbers = [float(names.index(name)) for name in ("P1-4-top", "P1-5-top", "P1-6-bottom")]
    mean = design * (1 + share) - design + 0.003
    rows = {"by": "face", "sensor": "laser", "family": "H", "low": numbers, "mean_m": mean}
    return pd.DataFrame(rows | {"sigma_mean_m": 1e-4})


def test_as_designed_nothing_is_said() -> None:
    found = measured_shape(planes(1.5), heights(0.0), MODEL)
    assert found["b_m"] == pytest.approx(3.0)
    assert found["e_m"] == pytest.approx(0.5)
    assert found["corner_deg"] == pytest.approx({"P1": 45.0, "P3": 45.0})
    assert not [*deviations_from_design(found, DESIGN, {})]


@pytest.mark.parametrize(
    ("half_width", "corner_deg", "share", "words"),
    [
        (1.506, 45.0, 0.0, "b = 3.0120 m where the config has 3 m"),
        (1.5, 45.0, 0.006, "e = 0.5030 m where the config has 0.5 m"),
        (1.5, 45.0, -0.006, "e = 0.4970 m where the config has 0.5 m"),
        (1.5, 45.3, 0.0, "45.30° between wall and P3"),
    ],
)
def test_what_differs_is_said_alone(half_width: float, corner_deg: float, share: float, words: str) -> None:
    found = measured_shape(planes(half_width, corner_deg), heights(share), MODEL)
    (warning,) = deviations_from_design(found, DESIGN, {})
    assert words in warning.words


@pytest.mark.parametrize("differs", [(1.504, 45.0, 0.0), (1.5, 45.19, 0.0), (1.5, 45.0, 0.003)])
def test_what_a_target_is_built_to_is_not_said(differs: tuple[float, float, float]) -> None:
    half_width, corner_deg, share = differs
    found = measured_shape(planes(half_width, corner_deg), heights(share), MODEL)
    assert not [*deviations_from_design(found, DESIGN, {})]


def test_the_passes_tell_how_certain_a_shape_is() -> None:
    """Four passes with corners of P3 0.6° apart, as an INS that drifts makes them; b is 3.00 or 3.02 m."""
    passes = [
        planes(half_width, corner_deg).query("sensor == 'laser' and `pass` == -1").assign(**{"pass": number})
        for number, (half_width, corner_deg) in enumerate([(1.5, 44.7), (1.51, 45.3), (1.5, 44.7), (1.51, 45.3)])
    ]
    errors = shape_errors(pd.concat(passes), MODEL)
    assert errors["P3"] == pytest.approx(0.6 / np.sqrt(12), rel=1e-6)  # scatter 0.6 / √3, of four
    assert errors["b_m"] == pytest.approx(0.02 / np.sqrt(12), rel=1e-6)
    assert errors["P1"] == pytest.approx(0.0, abs=1e-9)
    for corner_deg, said in ((45.65, False), (45.75, True)):  # beyond four of 0.173°
        found = measured_shape(planes(1.5, corner_deg), heights(0.0), MODEL)
        assert bool([*deviations_from_design(found, DESIGN, errors)]) == said
    assert shape_errors(planes(1.5), MODEL) == {}  # one pass tells nothing


def test_without_a_flank_there_is_no_width() -> None:
    found = measured_shape(planes(1.5).query("plane != 'P3'"), heights(0.0), MODEL)
    assert found["b_m"] is None
    assert set(found["corner_deg"]) == {"P1"}
    assert not [*deviations_from_design(found, DESIGN, {})]


def test_without_the_wall_no_angle_is_compared_with_the_walls() -> None:
    found = measured_shape(planes(1.5).query("plane != 'P2'"), heights(0.0), MODEL)
    assert found["corner_deg"] == {}
    assert not [*deviations_from_design(found, DESIGN, {})]
