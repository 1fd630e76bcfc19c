"""The result on one screen."""

import textwrap
from collections.abc import Collection, Mapping
from typing import Any

from pipeline.console import signed
from pipeline.maths.mount_parameters import PARAMETERS
from pipeline.mount import setting_change


def verdict_in_words(verdict: str, held: Collection[str] = ()) -> str:
    """The verdict as people read it; ``held``: of an accepted calibration the values that it could not find.

    >>> verdict_in_words("accepted"), verdict_in_words("accepted", ["yaw", "x"]), verdict_in_words("rejected", ["yaw"])
    ('accepted', 'accepted in part: roll, pitch, y, z', 'rejected')
    """
    if verdict != "accepted" or not held:
        return verdict
    return f"accepted in part: {', '.join(name for name, *_ in PARAMETERS if name not in held)}"


def summary(calibration: Mapping[str, Any]) -> str:
    """The result on one screen, from calibration.json."""
    held = calibration.get("held", {})
    kind, colon, found = verdict_in_words(calibration["verdict"], held).partition(": ")
    lines = [f"{calibration['session']}: {kind.upper()}{colon}{found}"]
    rejected = calibration["verdict"] == "rejected"
    lines += [f"  because {reason}" for reason in calibration["reasons"]]
    lines += [f"  not found, held at the coarse value: {', '.join(held)}"] if colon else []
    lines += [f"  warning: {warning}" for warning in calibration["warnings"]]
    sensor = calibration.get("calibrated", "mbes")
    heads = f"{sensor + ' mount':<12}{'coarse':>12}{'computed' if rejected else 'calibrated':>14}"
    heads += f"{'change':>14}{'sigma':>12}{'total':>12}"
    lines += ["", f"{heads}   (result: {calibration['result']})"]
    block, coarse = calibration[sensor], calibration["coarse"]["mount"]
    for parameter, _, key, of_setting in PARAMETERS:
        unit = "°" if of_setting == "deg" else of_setting
        total = f"{block['mount'][key]:.4f} {unit}" if block["mount"] else "-"
        change = f"{setting_change(block['mount'], coarse, key):+.4f} {unit}" if block["mount"] else "-"
        names = ("sigma_mount", "sigma_mount_total")
        sigmas = [f"{block[name][key]:.4f} {unit}" if block[name] else "-" for name in names]
        if parameter in held:
            change, sigmas[0] = "held", "-"
        lines.append(f"{parameter:<12}{coarse[key]:>10.4f} {unit}{total:>14}{change:>14}{sigmas[0]:>12}{sigmas[1]:>12}")
    use = "The calibrated values replace the coarse ones; 'change' is the difference: never apply both."
    lines += ["", "Do not use these values." if rejected else use]
    if block["sigma_mount"]:
        relative = "relative to the laser" if sensor == "mbes" else "with what is known of the target"
        lines.append(f"sigma: from noise, {relative}; total: with what does not average.")
    if not block["sigma_mount"] and calibration["result"] != "adjustment":
        lines.append("This method has no sigma of its own; those of the adjustment are in calibration.json.")
    lines += [f"Free: {one['words']}." for one in calibration["free"].values()]
    lines.append(_target_line(calibration["target"]))
    what = "soundings + laser points" if sensor == "mbes" else "laser points"
    lines.append(f"Points on the target by pass, distance of the INS from the wall, {what}:")
    seen = [p for p in calibration["passes"] if p["soundings"] or p["laser_points"]]
    both = sensor == "mbes"
    listed = (
        f"{p['pass']}: {p['distance_m']:.1f} m {str(p['soundings']) + ' + ' if both else ''}{p['laser_points']}"
        for p in seen
    )
    lines += textwrap.wrap(", ".join(listed), 110, initial_indent="  ", subsequent_indent="  ", break_on_hyphens=False)
    for key in ("weakest", "advice"):
        if calibration["geometry"][key]:
            lines.append(f"Geometry: {calibration['geometry'][key]}.")
    return "\n".join(lines)


def _target_line(target: Mapping[str, Any]) -> str:
    """The target's pose for the screen: an error of the laser's mount or of the origin is seen here first."""
    x, y, z = (signed(value, 3) for value in target["offset_m"])
    azimuth, first, second = (signed(angle, 2) for angle in (target["azimuth_correction_deg"], *target["tilt_deg"]))
    return f"Target found at x {x}, y {y}, z {z} m from target.origin, azimuth {azimuth}°, tilt {first}° {second}°."
