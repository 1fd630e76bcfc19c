"""Reasons to reject by the limits of the verdict: total sigmas, soundings, and the difference of a patent's form."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.config.verdict import VerdictLimits
from pipeline.limits.verdict_limits import in_report_units, largest_sigmas, limits_by_setting, soundings_too_uncertain
from pipeline.maths.mount_parameters import MOUNT_WORDS, PARAMETERS
from pipeline.report.reason_codes import ReasonCode, Statement

NAMED_SOURCES, LEAST_SHARE = 2, 0.15  # at most so many sources of a sigma are named, from this share of its square on
LARGEST = "largest sources:"  # before their names, the largest first


def sigmas_above_limit(
    sigmas: Mapping[str, float] | None,
    limits: VerdictLimits,
    held: Collection[str],
    sources: Mapping[str, NDArray[np.float64]],
) -> list[Statement]:
    """Return a reason for each mount parameter whose total sigma is above its limit, with its largest sources.

    Parameters
    ----------
    sigmas : total sigmas by setting, degrees and m; None if the adjustment has none
    limits : limits of the total sigmas
    held : names of the parameters that may be above it
    sources : contributions (6,) of the sources to the total sigmas, rad and m, by their words
    """
    if sigmas is None:
        return [Statement(ReasonCode.NO_COVARIANCE, "the adjustment has no covariance")]
    largest, symbols = limits_by_setting(limits), {"deg": "°", "m": " m"}
    found = []
    for name, place, key, unit in PARAMETERS:
        limit, symbol = largest[key], symbols[unit]
        if name not in held and not sigmas[key] <= limit:
            above, most = f"{sigmas[key]:.4g}{symbol}", f"{limit:.4g}{symbol}"
            words = f"total sigma of {MOUNT_WORDS[place]} is {above}, above the limit of {most}"
            found.append(Statement(ReasonCode.SIGMA_ABOVE_LIMIT, f"{words}{_largest(sources, place, unit)}"))
    return found


def soundings_above_limit(
    covariance: Sequence[Sequence[float]] | None, limits: VerdictLimits
) -> Iterator[Statement]:
    """Yield a reason if all errors of the sonar's mount together take too much of what an order of survey allows.

    Parameters
    ----------
    covariance : (6, 6) total covariance of the sonar's mount, rad and m; None if the adjustment has none
    limits : limits of the verdict
    """
    words = "" if covariance is None else soundings_too_uncertain(limits, np.array(covariance))
    if words:
        yield Statement(ReasonCode.SOUNDINGS_ABOVE_LIMIT, words)


def _largest(sources: Mapping[str, NDArray[np.float64]], place: int, unit: str) -> str:
    """Return in words the largest contributions to one sigma; nothing if no source is known."""
    scale, symbol = (float(np.degrees(1.0)), "°") if unit == "deg" else (1.0, " m")
    sizes = {words: scale * float(of_source[place]) for words, of_source in sources.items()}
    least = np.sqrt(LEAST_SHARE * sum(size**2 for size in sizes.values()))
    largest = sorted(sizes.items(), key=lambda item: -item[1])[:NAMED_SOURCES]
    named = [f"{words} ({size:.2g}{symbol})" for words, size in largest if size > least]
    return f"; {LARGEST} {', '.join(named)}" if named else ""


def patent_reasons(
    method: str, row: Any, methods: Mapping[str, Mapping[str, Any]], limits: VerdictLimits
) -> Iterator[Statement]:
    """Yield each reason why a form of the patent cannot be the result.

    A form of the patent has no sigma. Instead it must have converged, and its correction must agree with that of the
    adjustment within the limits of the total sigmas.

    Parameters
    ----------
    method : name of the form, patent_sequential or patent_alternating
    row : row of this form in the table ``corrections``
    methods : blocks of calibration.json by method
    limits : limits of the total sigmas
    """
    if row["reason"]:
        yield Statement(ReasonCode.PATENT_NO_RESULT, f"{method} has no result: {row['reason']}")
        return
    if not row["converged"]:
        yield Statement(ReasonCode.PATENT_NOT_CONVERGED, f"{method} did not converge in {row['iterations']} turns")
        return
    patent, adjusted = methods[method]["correction"], methods["adjustment"]["correction"]
    largest = in_report_units(largest_sigmas(limits))
    for part, unit, first in (("rotation_vector_deg", "°", 0), ("lever_arm_m", " m", 3)):
        for place, (value, reference) in enumerate(zip(patent[part], adjusted[part], strict=True), start=first):
            if abs(value - reference) > largest[place]:
                yield Statement(
                    ReasonCode.PATENT_OFF_ADJUSTMENT,
                    f"{method} differs from the adjustment by {value - reference:+.4f}{unit} in {MOUNT_WORDS[place]}, "
                    f"more than {largest[place]:.4g}{unit}",
                )
