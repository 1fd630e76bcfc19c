"""The output of poolcal check: text for people, JSON for programs."""

import json
from typing import Any

import numpy as np

from pipeline.checking.check_session import SessionCheck
from pipeline.checking.expected_soundings import USUAL
from pipeline.checking.file_lines import gaps_line, left_out_lines
from pipeline.checking.file_survey import SurveyedFile
from pipeline.checking.ins_quality import InsQuality
from pipeline.checking.track import Leg
from pipeline.gps_time import utc_text
from pipeline.maths.target.family_words import families_in_words
from pipeline.maths.target.model import names_in_order
from pipeline.text_table import text_table, wrapped

OF_PASSES = (
    "From, seconds, distance and speed are of the part of a pass beside the target; in the report they are of the "
    "whole pass, which begins earlier."
)
ESTIMATED = "~: estimated from a sample of the soundings."


def check_text(examined: SessionCheck, note: str = "") -> str:
    """Return the text for the screen: files, quality of the INS, passes, soundings and findings.

    Parameters
    ----------
    examined
        The session, checked.
    note
        A sentence that is no finding; empty: none.
    """
    heads = ("sensor", "file", "kind", "records", "from (UTC)", "to", "rate")
    lines = text_table("<7<4  <24>11  <21<10>9", heads, [_file_cells(file) for file in examined.files])
    if any(file.share < 1 or not file.ended for file in examined.files):
        lines.append("~: read in part")
    lines += left_out_lines(examined.files)
    lines += _quality_lines(examined.quality)
    if examined.gaps is not None and len(examined.gaps):
        lines += wrapped(gaps_line(examined.gaps))
    lines += wrapped(f"Note: {note}.") if note else []
    if examined.legs:
        lines += ["", *_pass_lines(examined)]
    lines += _soundings_lines(examined)
    lines.append("")
    for severity, head in (("fault", "Wrong"), ("look", "But look")):
        sentences = [f"{head}: {found.words}." for found in examined.findings if found.severity == severity]
        lines += [line for sentence in sentences for line in wrapped(sentence)]
    if not examined.findings:
        lines.append("Nothing found.")
    return "\n".join(lines)


def _pass_lines(examined: SessionCheck) -> list[str]:
    rows = [
        (
            str(number),
            utc_text(leg.start_ns),
            f"{(leg.end_ns - leg.start_ns) / 1e9:.1f}",
            f"{leg.distance_m:.2f} m",
            f"{leg.speed_m_s:.2f} m/s",
            f"{leg.ran['laser']:.0%}",
            f"{leg.ran['mbes']:.0%}",
            _why_not(leg),
        )
        for number, leg in enumerate(examined.legs)
    ]
    heads = ("pass", "from (UTC)", "seconds", "distance", "speed", "laser", "sonar")
    return [*text_table("<6<22>8>10>10>8>8  <1", heads, rows), *wrapped(OF_PASSES, following="")]


def _why_not(leg: Leg) -> str:
    """Return why a pass does not count; empty if it does."""
    if leg.good:
        return ""
    return "behind the target" if leg.distance_m <= 0 else "target to port, where the sonar does not look"


def _quality_lines(found: InsQuality) -> list[str]:
    """Return the text lines with the states and sigmas in the INS's log; none if the log has neither."""
    lines = []
    for name, kinds in found.by_file.items():
        for counts in kinds.values():
            shares = (f"{state} {number / counts.total():.0%}" for state, number in counts.most_common())
            lines.append(f"{name}: {', '.join(shares)} of {counts.total():,} records used")
    if found.sigmas:
        units = {name: "°" if name.endswith("deg") else " m" for name in found.sigmas}
        axes = {name: name.rpartition("_")[0].replace("_", " and ") for name in found.sigmas}
        said = ", ".join(f"{axes[name]} {sigma:.2g}{units[name]}" for name, sigma in found.sigmas.items())
        lines.append(f"ins, by its own sigmas {'in the passes' if found.of_passes else 'in the whole log'}: {said}")
    return lines


def _by_face(examined: SessionCheck) -> list[dict[str, Any]]:
    """Return a mapping for each wet face, with the soundings expected and found; none if they were not counted."""
    if examined.model is None or examined.soundings is None:
        return []
    both = zip(examined.model.faces, examined.soundings.expected, examined.soundings.found, strict=True)
    wet = examined.model.water_level_m
    return [
        {"face": face.name, "family": face.family, "expected": round(float(expected)), "found": round(float(found))}
        for face, expected, found in both
        if face.seen != "dry" and face.vertices_m[:, 2].min() < wet
    ]


def _soundings_lines(examined: SessionCheck) -> list[str]:
    """Return the text lines with expected and found soundings by family. The JSON has them by face."""
    faces = _by_face(examined)
    if not faces:
        return []
    rows = []
    order = names_in_order(examined.model.families) if examined.model is not None else ()
    for family in [family.name for family in order if any(face["family"] == family.name for face in faces)]:
        expected, found = (sum(f[key] for f in faces if f["family"] == family) for key in ("expected", "found"))
        share = f"{found / expected:.0%}" if expected else "-"
        rows.append((family, f"~{expected}", f"~{found}", share))
    table = text_table("<22>10>10>8 <1", ("soundings on", "expected", "found", "share", f"({USUAL})"), rows)
    families = () if examined.model is None else wrapped(f"{families_in_words(examined.model)}.", following="")
    return ["", *table, ESTIMATED, *families]


def _file_cells(file: SurveyedFile) -> tuple[str, ...]:
    about = "" if file.share == 1.0 and file.ended else "~"
    first, last = (utc_text(t) for t in file.span_ns) if len(file.epochs_ns) else ("-", "-")
    last = last[11:] if last[:10] == first[:10] else last
    rate = _rate(file.rate_hz) if np.isfinite(file.rate_hz) else "-"
    return file.sensor, file.name, file.kind, f"{about}{file.records}", first, last, rate


def _rate(rate_hz: float) -> str:
    """Return a rate as text, to three significant digits.

    >>> _rate(10638.7), _rate(199.98), _rate(9.9)
    ('10600 Hz', '200 Hz', '9.9 Hz')
    """
    return f"{float(f'{rate_hz:.3g}'):.15g} Hz"


def check_json(examined: SessionCheck, note: str = "") -> str:
    """Return the same as JSON; times are GPS nanoseconds."""
    content: dict[str, Any] = {
        "faulty": examined.faulty,
        "notes": [note] if note else [],
        "findings": [{"question": f.question, "severity": f.severity, "words": f.words} for f in examined.findings],
        "files": [
            {
                "sensor": file.sensor,
                "file": file.name,
                "kind": file.kind,
                "bytes": file.size,
                "share_read": file.share if file.ended else None,
                "records": file.records,
                "dropped": {reason: number for reason, number in sorted(file.dropped.items()) if number},
                "first_ns": file.span_ns[0] if len(file.epochs_ns) else None,
                "last_ns": file.span_ns[1] if len(file.epochs_ns) else None,
                "rate_hz": file.rate_hz if np.isfinite(file.rate_hz) else None,
            }
            for file in examined.files
        ],
        "ins_states": examined.quality.by_file,
        "ins_sigmas": examined.quality.sigmas,
        "soundings": _by_face(examined),
        "passes": [
            {
                "start_ns": leg.start_ns,
                "end_ns": leg.end_ns,
                "distance_m": leg.distance_m,
                "speed_m_s": leg.speed_m_s,
                "good": leg.good,
                "ran": dict(leg.ran),
            }
            for leg in examined.legs
        ],
    }
    return json.dumps(content, indent=1, ensure_ascii=False)
