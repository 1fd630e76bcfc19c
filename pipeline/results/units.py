"""Differences of mounts in the units in which people read them: degrees, metres and, on the screen, millimetres."""

from dataclasses import dataclass
from decimal import ROUND_CEILING, Decimal

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
UNITS = ("deg",) * 3 + ("m",) * 3  # of the mount parameters, in their order
TO_UNITS = np.repeat([np.degrees(1.0), 1.0], 3)  # factors that turn rad and m into these units
SCALES = {"deg": ("°", 1.0, 4), "m": (" mm", 1000.0, 2)}  # by unit: unit, factor and digits on the screen


@dataclass(frozen=True)
class Tolerances:
    """Largest tolerated differences of an angle (degrees) and of a lever-arm component (mm); None: no limit."""

    angle_deg: float | None = None
    lever_arm_mm: float | None = None

    def limits(self) -> Array:
        """Return the limits (6,) of the six parameters, rad and m; NaN: no limit."""
        angle_rad = np.nan if self.angle_deg is None else np.radians(self.angle_deg)
        return np.repeat([angle_rad, np.nan if self.lever_arm_mm is None else self.lever_arm_mm / 1000], 3)


def quantity_text(value: float, unit: str, sign: str = "+") -> str:
    """Return a difference or a sigma as text for the screen.

    Parameters
    ----------
    value
        The quantity, in degrees or metres.
    unit
        ``deg`` or ``m``; metres are shown as mm.
    sign
        ``+`` to show the sign of a positive value too.

    >>> quantity_text(0.0012, "m"), quantity_text(0.5, "deg", "")
    ('+1.20 mm', '0.5000°')
    """
    suffix, scale, digits = SCALES[unit]
    return f"{value * scale:{sign}.{digits}f}{suffix}"


def least_text(value: float, unit: str) -> str:
    """Return a least size with two digits, rounded up, as text for the screen; ``unit``: deg or m, shown as mm.

    >>> least_text(0.1512, "deg"), least_text(0.00831, "m"), least_text(0.0123, "m")
    ('0.16°', '8.4 mm', '13 mm')
    """
    suffix, scale, _ = SCALES[unit]
    number = Decimal(f"{value * scale:.9g}")
    digit = Decimal(1).scaleb(number.adjusted() - 1)
    return f"{number.quantize(digit, ROUND_CEILING):f}{suffix}"
