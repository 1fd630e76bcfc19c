"""What the patent's form (2) says of the adjustment: whether the check holds, in words for the report."""

from collections.abc import Mapping
from typing import Any

from pipeline.mount import setting_change
from pipeline.results.pages.mount_tables import METHODS, Quantity

CHECKING = "patent_alternating"
CHECKED = {"roll": "roll_deg", "pitch": "pitch_deg", "x": "x_m"}  # of the others it tells too little
MOST_SIGMAS = 4.0  # total sigmas of the adjustment within which the form agrees


def patent_check(methods: Mapping[str, Mapping[str, Any]]) -> str:
    """Return in words how far form (2) is from the adjustment; an empty text if one of them has no result.

    The difference has no sigma of its own: both methods see the same points and errors, and weigh them otherwise. The
    form takes the sound speed as recorded, and all points alike; the adjustment allows for a sound speed that changes
    with depth, which goes together with roll. So the limit is one of experience. In 19 simulated sessions with all
    errors drawn by their sigmas (``tools.drawn_errors``; scenarios default, drift, small_target, azimuth_163) the
    differences were 1.1 (roll), 0.8 (pitch) and 0.9 (x) total sigmas (RMS), at most 2.2. After so few sessions each
    RMS may in truth be 1.4 times as large (95 %); if all three are, one session of 90 without faults is beyond 4.

    Yaw, y and z are left out, for there the form is worse than the total sigmas by its own making: yaw and y (9 and 5
    total sigmas, RMS) because it takes a drift of the INS for them, z (2.1) because it finds it by horizontal faces
    alone, to which the adjustment gives little weight, as their ranges may be off (``mbes.level_bias_sigma_m``).

    Parameters
    ----------
    methods
        The block ``methods`` of calibration.json.
    """
    adjusted, form = methods["adjustment"], methods.get(CHECKING)
    sigmas = adjusted["sigma_mount_total"]
    if form is None or not (form["mount"] and adjusted["mount"] and sigmas):
        return ""
    changes = {name: setting_change(form["mount"], adjusted["mount"], key) for name, key in CHECKED.items()}
    ratios = {name: abs(changes[name]) / sigmas[key] for name, key in CHECKED.items()}
    worst = max(ratios, key=lambda name: ratios[name])
    change = Quantity(changes[worst], "deg" if CHECKED[worst].endswith("deg") else "m").small("+")
    here = f"Here form {METHODS[CHECKING][:3]} is off by {ratios[worst]:.1f} total sigmas at most ({worst} {change})"
    if ratios[worst] <= MOST_SIGMAS:
        return f"{here}: the check holds."
    return (
        f"{here}, more than {MOST_SIGMAS:g}: the check does not hold. Look at the residuals and at the agreement of "
        "the planes, and do not use the values before you know why."
    )
