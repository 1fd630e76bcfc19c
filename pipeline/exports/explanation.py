"""What every form tells beside its numbers: their meaning, their certainty, and what must not be done with them."""

from collections.abc import Mapping

import pipeline
from pipeline.exports.convention import CERTAINTY_WORDS
from pipeline.exports.mounting import OF_INS, SENSOR_WORDS, Mounting
from pipeline.exports.order_check import spread_sentence
from pipeline.exports.target import Options, Target

REJECTED = "REJECTED"


def heading(target: Target, mounting: Mounting) -> list[str]:
    """Return the first lines of a form: target, run, verdict."""
    origin = mounting.origin
    lines = [
        f"poolcal export: {target.title} ({target.name})",
        f"Session {origin.session}, run {origin.run}, {SENSOR_WORDS[mounting.sensor]}: {origin.kind}. "
        f"poolcal {pipeline.__version__}",
    ]
    return [*lines, *_evidence(mounting), *rejection(mounting)]


def _evidence(mounting: Mounting) -> list[str]:
    """Return what tells a sheet found in an office apart from another: verdict, time of the passes, digest."""
    origin = mounting.origin
    verdict = [] if origin.rejected is not None else ["Verdict: accepted."]
    if verdict and origin.purpose:
        verdict = [f"Verdict: accepted for {origin.purpose}. Do not use the values for other surveys."]
    begins = [] if origin.start_utc is None else [f"First pass: {origin.start_utc}."]
    digest = [] if origin.digest is None else [f"SHA-256 of calibration.json: {origin.digest}"]
    return [*([" ".join([*verdict, *begins])] if verdict or begins else []), *digest]


def rejection(mounting: Mounting) -> list[str]:
    """Return the mark of a rejected run; nothing if it was accepted."""
    if mounting.origin.rejected is None:
        return []
    because = "; ".join(mounting.origin.rejected) or "see its report"
    return [f"{REJECTED}: this run was rejected. Do not survey with these values. Reason: {because}"]


def explanation(target: Target, mounting: Mounting, options: Options, zeros: str = "") -> list[str]:
    """Return the sentences under a form's numbers.

    Parameters
    ----------
    target, mounting, options
        The program, the mount, and what the user told.
    zeros
        What must be zero in the program, as a sentence; empty: nothing.
    """
    convention = target.convention
    order = convention.order_used(options.order)
    words = convention.words()
    lines = [
        "These are totals: they replace what stands there. Do not add them to anything.",
        *([zeros] if zeros else []),
        OF_INS if target.counts_from == "ins" else mounting.frame.sentence(),
        "Signs: " + ", ".join(f"{role} {words[role]}" for role in ("x", "y", "z", "roll", "pitch")) + f", heading: "
        f"{words['yaw']}.",
        f"Order of rotations: {order} (Y heading, P pitch, R roll; the leftmost is outermost).",
    ]
    if convention.order is None:
        lines.append(spread_sentence(mounting.vessel.R_body_from_sensor, options))
    if mounting.origin.held:
        lines.append(f"Not good enough by the run itself: {', '.join(mounting.origin.held)}.")
    lines += [
        f"Estimated with the mount: {words}. The values hold with that alone: correct it before you enter them."
        for words in mounting.origin.free
    ]
    if mounting.latency_s:
        lines.append(
            f"Latency: the {SENSOR_WORDS[mounting.sensor]}'s times are {mounting.latency_s:.6f} s late against the "
            "INS's "
            "(subtract this from them). Check that it is set, with the program's own sign."
        )
    if mounting.covariance is not None:
        lines.append(
            "Sigmas are total, one standard deviation (68 %). Where the program asks for 95 %, enter 1.96 times as "
            "much."
        )
    certainty = f"Certainty: {convention.certainty}, {CERTAINTY_WORDS[convention.certainty]}."
    return [*lines, certainty, f"Source: {convention.source}."]


def sigmas_of(target: Target, mounting: Mounting, options: Options) -> Mapping[str, float] | None:
    """Return the standard deviations of the six numbers by role, in the program's terms; None if they are not known."""
    covariance = mounting.covariance_vessel
    if covariance is None:
        return None
    return target.convention.sigmas(mounting.vessel, covariance, options.order)
