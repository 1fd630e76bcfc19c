"""The covariance of a mount in session.yaml: what is none, and that of another mount."""

from typing import Any

import numpy as np
import pytest

from pipeline.config.session import Laser
from pipeline.config.yaml_models import parse
from pipeline.errors import ConfigError
from tests.support.marks import KEYS

LASER: dict[str, Any] = {"files": ["a"], "format": "las", "mount": dict.fromkeys(KEYS, 0.0)}


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ((0, 1, 0.5), "must be symmetric"),
        ((0, 0, -1.0), "must be"),
        (None, "has too few entries"),
        ("indefinite", "must be positive semidefinite"),
    ],
)
def test_a_covariance_that_is_none_is_refused(change: Any, words: str) -> None:
    matrix = np.eye(6)
    if isinstance(change, tuple):
        matrix[change[:2]] = change[2]
    elif change == "indefinite":
        matrix[:3, :3] = [[1, 0.9, -0.9], [0.9, 1, 0.9], [-0.9, 0.9, 1]]
    rows = matrix.tolist()[: 5 if change is None else 6]
    with pytest.raises(ConfigError) as refused:
        parse(Laser, LASER | {"mount_covariance": rows}, "session.yaml")
    (line,) = str(refused.value).splitlines()
    assert line.startswith("session.yaml: mount_covariance")
    assert words in line


def test_a_covariance_of_another_mount_is_refused() -> None:
    """As where the mount is entered by hand, and what poolcal wrote beside it stays."""
    six = {key: float(value) for key, value in LASER["mount"].items()}
    origin = {"method": "fine", "file": "a", "sha256": "0" * 64, "date": "2026-05-12", "software": "p", "mount": six}
    written = LASER | {"mount_covariance": (np.eye(6) * 1e-6).tolist(), "mount_origin": origin}
    assert parse(Laser, written, "s").mount_origin is not None
    by_hand = {"mount": six | {"z_m": six["z_m"] + 0.000001}}
    with pytest.raises(ConfigError, match="mount is not the one in mount_origin, to which mount_covariance belongs"):
        parse(Laser, written | by_hand, "s")
    assert parse(Laser, {key: one for key, one in (written | by_hand).items() if "_" not in key}, "s")


def test_a_covariance_without_rank_is_one() -> None:
    for matrix in (np.zeros((6, 6)), np.ones((6, 6)) * 1e-6, np.diag([1e-6, 0, 0, 1e-6, 0, 0])):
        assert parse(Laser, LASER | {"mount_covariance": matrix.tolist()}, "s").mount_covariance is not None
