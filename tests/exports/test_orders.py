"""Programs whose order of rotations nobody states: refused above 0.02°; told by --order; what it costs."""

from itertools import permutations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from pipeline.errors import ConfigError
from pipeline.exports.orders import ORDERS, composed, decomposed, errors_by_order, partials
from pipeline.exports.registry import TARGETS
from pipeline.exports.target import Options
from pipeline.exports.writing import export_text
from tests.support.mountings import mounted, mounting, random_mounts
from tests.support.programs import READERS, sfu_rotation

UNKNOWN = ["caris", "caris-hvf", "hypack"]


def worst(roll: float, pitch: float, yaw: float) -> float:
    """The largest turn, degrees, by which a program errs that composes our numbers in another order."""
    true = sfu_rotation("YPR", roll, pitch, yaw)
    errors = [sfu_rotation("".join(order), roll, pitch, yaw) @ true.T for order in permutations("YPR")]
    return max(float(np.degrees(np.arccos(np.clip((np.trace(R) - 1) / 2, -1, 1)))) for R in errors)


def at_limit(limit_deg: float) -> tuple[float, float, float]:
    """A mount of three equal angles whose worst error is the limit."""
    low, high = 0.0, 5.0
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (middle, high) if worst(middle, middle, middle) < limit_deg else (low, middle)
    return low, low, low


def test_the_numbers_of_the_design() -> None:
    """exports.md, 3: the mount above in each order, computed there with scipy alone."""
    R = sfu_rotation("YPR", -48.8, 1.2, -2.0)
    errors = errors_by_order(R, "YPR")
    assert errors.pop("YPR") < 1e-9
    assert {order: round(error, 3 if order == "PYR" else 2) for order, error in errors.items()} == {
        "PYR": 0.042, "YRP": 0.99, "PRY": 1.65, "RYP": 1.93, "RPY": 1.93,
    }  # fmt: skip
    assert worst(0.5, 0.5, 0.5) < 0.0085


@pytest.mark.parametrize("order", ORDERS)
def test_angles_by_order_compose_to_the_mount(order: str) -> None:
    for body in random_mounts():
        R = body.R_body_from_sensor
        angles = decomposed(R, order)
        np.testing.assert_allclose(composed(angles, order), R, atol=1e-12)
        np.testing.assert_allclose(
            sfu_rotation(order, *np.degrees([angles["R"], angles["P"], angles["Y"]])), R, atol=1e-12
        )


@pytest.mark.parametrize("order", ORDERS)
def test_partials_are_differences(order: str) -> None:
    step = 1e-6
    for body in random_mounts(20)[3:]:
        R = body.R_body_from_sensor
        rows = partials(decomposed(R, order), order)
        for axis in range(3):
            turns = [Rotation.from_rotvec(sign * step * np.eye(3)[axis]).as_matrix() @ R for sign in (1, -1)]
            plus, minus = (decomposed(turned, order) for turned in turns)
            for letter in "RPY":
                difference = (plus[letter] - minus[letter]) / (2 * step)
                assert rows[letter][axis] == pytest.approx(difference, rel=1e-4, abs=1e-6)


@pytest.mark.parametrize("name", UNKNOWN)
def test_both_sides_of_the_limit(name: str) -> None:
    target, options = TARGETS[name], Options()
    below, above = (mounting(mounted(*at_limit(limit))) for limit in (0.0199, 0.0201))
    text = export_text(target, below, options)
    assert "The maker does not state the order: YPR is assumed" in " ".join(text.split())
    with pytest.raises(ConfigError, match=r"--order: is needed: .* a wrong one is 0\.02° off"):
        export_text(target, above, options)


@pytest.mark.parametrize("name", UNKNOWN)
def test_a_turned_ins_counts_too(name: str) -> None:
    """The mount on the body is level; in the vessel it is not."""
    from tests.support.mountings import FRAMES

    level = mounting(mounted(0.1, 0.1, 0.1))
    export_text(TARGETS[name], level, Options())
    with pytest.raises(ConfigError, match="--order: is needed"):
        export_text(TARGETS[name], mounting(mounted(0.1, 0.1, 0.1), frame=FRAMES[2]), Options())


def test_other_orders_are_not_taken_where_the_order_is_known() -> None:
    body = mounting(mounted(-48.8, 1.2, -2.0))
    with pytest.raises(ConfigError, match="--order RPY: qinsy turns in the order YPR"):
        export_text(TARGETS["qinsy"], body, Options(order="RPY"))
    with pytest.raises(ConfigError, match="--order YYP: is none of YPR, YRP"):
        export_text(TARGETS["caris"], body, Options(order="YYP"))


def test_numbers_differ_by_order_and_each_is_right_in_its_own() -> None:
    body = mounted(-48.8, 1.2, -2.0, 0.3, 0.2, -2.01)
    texts = {order: export_text(TARGETS["hypack"], mounting(body), Options(order=order, ins_height_m=1.0))
             for order in ORDERS}  # fmt: skip
    assert len(set(texts.values())) == 6
    for order, text in texts.items():
        R, _ = READERS["hypack"](text, order)
        np.testing.assert_allclose(R, body.R_body_from_sensor, atol=1e-10)
