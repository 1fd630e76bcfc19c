"""The result of a run on one screen."""

import textwrap
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from pipeline.console import signed
from pipeline.maths.mount_parameters import PARAMETERS
from pipeline.mount import setting_change
from pipeline.report.reason_codes import verdict_of
from pipeline.text_table import SCREEN, text_table, wrapped

SIGMAS_IN_WORDS = {
    "mbes": (
        "sigma: the random part, from the noise of the sensors and the INS, relative to the laser.",
        "total: with the systematic errors of the laser's mount, ranges, sound speed, clocks, target.",
    ),
    "laser": (
        "sigma: the random part, from the noise of the laser and the INS.",
        "total: with the uncertainty of target and coarse mount, and the errors of ranges and clock.",
    ),
}


def summary(calibration: Mapping[str, Any]) -> str:
    """Return the result as text for the screen, from the content of calibration.json."""
    held = calibration.get("held", {})
    verdict, colon, good = verdict_of(calibration).partition(": ")
    verdict, word, purpose = verdict.partition(" for ")
    lines = [f"{calibration['session']}: {verdict.upper()}{word}{purpose}{colon}{good}"]
    rejected = calibration["verdict"] == "rejected"
    lines += _indented(f"because {reason}" for reason in calibration["reasons"])
    lines += [f"  not good enough: {', '.join(held)}"] if colon else []
    lines += _indented(f"warning: {warning}" for warning in calibration["warnings"])
    sensor = calibration.get("calibrated", "mbes")
    for head in calibration.get("heads") or [calibration[sensor] | {"coarse": calibration["coarse"], "name": sensor}]:
        lines += ["", *_mount_table(head, calibration)]
    block = calibration[sensor]
    use = "The calibrated values replace the coarse ones; 'change' is the difference: never apply both."
    lines += ["", "Do not use these values." if rejected else use]
    if block["sigma_mount"]:
        lines += SIGMAS_IN_WORDS[sensor]
        lines += [] if rejected else ["Use the total sigma."]
    if not block["sigma_mount"] and calibration["result"] != "adjustment":
        lines.append("This method has no sigma of its own; those of the adjustment are in calibration.json.")
    lines += [line for parameter in calibration["free"].values() for line in wrapped(f"Free: {parameter['words']}.")]
    lines.append(_target_line(calibration["target"]))
    lines += _pass_lines(calibration["passes"], sensor)
    for key in ("weakest", "advice"):
        if calibration["geometry"][key]:
            lines += wrapped(f"Geometry: {calibration['geometry'][key]}.")
    return "\n".join(lines)


def _indented(sentences: Iterable[str]) -> list[str]:
    """Return sentences in lines, indented, their further lines more so."""
    return [line for sentence in sentences for line in wrapped(sentence, "  ", "    ")]


def _mount_table(block: Mapping[str, Any], calibration: Mapping[str, Any]) -> list[str]:
    """Return the text lines of a mount's table: coarse and calibrated values, their differences and sigmas.

    ``block``: the sensor's, or the head's, with its name and its coarse mount.
    """
    coarse, rows = block["coarse"]["mount"], []
    for parameter, _, key, unit_of_setting in PARAMETERS:
        unit = "°" if unit_of_setting == "deg" else unit_of_setting
        total, change = "-", "-"
        if block["mount"]:
            total = f"{block['mount'][key]:.4f} {unit}"
            change = f"{setting_change(block['mount'], coarse, key):+.4f} {unit}"
        sigma, sigma_total = (
            f"{block[name][key]:.4f} {unit}" if block[name] else "-" for name in ("sigma_mount", "sigma_mount_total")
        )
        rows.append((parameter, f"{coarse[key]:.4f} {unit}", total, change, sigma, sigma_total))
    computed = "computed" if calibration["verdict"] == "rejected" else "calibrated"
    result = f"(result: {calibration['result']})"
    heads = (f"{block['name']} mount", "coarse", computed, "change", "sigma", "total", result)
    return text_table("<12>12>14>14>12>12   <1", heads, rows)


def _pass_lines(passes: Sequence[Mapping[str, Any]], sensor: str) -> list[str]:
    """Return text lines with each pass's distance from the wall and number of points on the target."""
    is_sonar = sensor == "mbes"
    points = "soundings + laser points" if is_sonar else "laser points"
    listed = []
    for row in passes:
        if row["soundings"] or row["laser_points"]:
            counts = f"{row['soundings']} + {row['laser_points']}" if is_sonar else f"{row['laser_points']}"
            listed.append(f"{row['pass']}: {row['distance_m']:.1f} m {counts}")
    lines = textwrap.wrap(
        ", ".join(listed), SCREEN, initial_indent="  ", subsequent_indent="  ", break_on_hyphens=False
    )
    return [f"Points on the target by pass, distance of the INS from the wall, {points}:", *lines]


def _target_line(target: Mapping[str, Any]) -> str:
    """Return the sentence on the target's pose relative to target.origin.

    A user sees an error of the laser's mount or of target.origin here, before it appears in any other figure.
    """
    x, y, z = (signed(value, 3) for value in target["offset_m"])
    azimuth, first, second = (signed(angle, 2) for angle in (target["azimuth_correction_deg"], *target["tilt_deg"]))
    return f"Target found at x {x}, y {y}, z {z} m from target.origin, azimuth {azimuth}°, tilt {first}° {second}°."
