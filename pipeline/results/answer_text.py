"""Has the sonar moved? The answer in a sentence, what could have been seen, and whose errors were counted how."""

from collections.abc import Iterator, Mapping
from typing import Any

from pipeline.maths.mount_parameters import MOUNT_WORDS
from pipeline.results.mount_difference import Row, is_same_result
from pipeline.results.units import least_text, quantity_text


def answer_sentence(difference: Mapping[str, Any]) -> str:
    """Return one sentence that says whether the mount has moved, or why there is no answer."""
    rejected = [
        f"{key} ({difference[key]['session']}) was rejected"
        for key in ("a", "b")
        if difference[key]["verdict"] == "rejected"
    ]
    if rejected and is_same_result(difference):
        return f"the same result in both; {_listed(rejected)}"
    if rejected:
        return f"no answer: {_listed(rejected)}, and what must not be used cannot be compared"
    if not difference["comparable"]:
        return f"no answer: {difference['not_compared'][0]}"
    sentence = _answer(difference)
    if difference["beyond_tolerance"]:
        sentence += f"; beyond the tolerance: {_listed(difference['beyond_tolerance'])}"
    return sentence


def _answer(difference: Mapping[str, Any]) -> str:
    if is_same_result(difference):
        return "the same result in both"
    chance = f"p = {difference['joint']['probability']:.2g}"
    if difference["answer"] == "moved":
        each = [_with_sigma(row) for row in difference["parameters"] if row["moved"]]
        rest = "" if len(each) == len(MOUNT_WORDS) else "; the rest within its errors"
        if difference["inputs"]:
            return f"the sonar has moved, {_listed(each)}: significant ({chance}){rest}"
        return f"the raw files are the same, so settings or software have moved the result, {_listed(each)}{rest}"
    within = f"all six differences are within their errors ({chance})"
    if difference["answer"] == "no_movement_shown":
        if not difference["inputs"]:
            within += (
                "; but both runs are of the same raw files, with the same noise, so the errors of the difference are "
                "smaller than counted here"
            )
        return f"no movement shown: {within}"
    rows = [row for row in difference["parameters"] if row["uncertain"]]
    unseen = [f"{least_text(row['detectable'], row['unit'])} in {row['parameter']}" for row in rows]
    causes = [*dict.fromkeys(row["mostly"] for row in rows)]
    return (
        f"too uncertain to say: {within}, but a movement of up to {_listed(unseen)} may be hidden in them; most of "
        f"the uncertainty: {_listed(causes)}"
    )


def visible_sentence(difference: Mapping[str, Any]) -> str:
    """Return one sentence that says which movements would have been found; empty if the raw files are the same."""
    if not difference["answered"] or not difference["inputs"]:
        return ""
    sizes = [f"{row['parameter']} {least_text(row['detectable'], row['unit'])}" for row in difference["parameters"]]
    power = f"{100 * difference['joint']['power']:.0f} %"
    return f"found with a probability of {power}, whatever moves beside it: {', '.join(sizes)}, or more"


def answer_lines(difference: Mapping[str, Any]) -> Iterator[str]:
    """Yield the answer, what could have been seen, and notes on errors that were not counted as usual, as sentences."""
    for words in (difference["sentence"], difference["visible"], *_error_notes(difference["errors"])):
        if words:
            yield f"{words[0].upper()}{words[1:]}."


def _error_notes(errors: Mapping[str, Any] | None) -> Iterator[str]:
    if errors is None:
        return
    if errors["cautious"]:
        yield (
            "a result is of an older version, which did not tell its errors apart: both total covariances were added, "
            "as if the sessions shared no error; poolcal run again makes the test sharper"
        )
    for words in errors["differing"]:
        yield f"{words} is not the same in both: its errors were counted as each session's own"


def _with_sigma(row: Row) -> str:
    difference, sigma = quantity_text(row["difference"], row["unit"]), quantity_text(row["sigma"], row["unit"], "")
    return f"{row['parameter']} by {difference} ± {sigma}"


def _listed(words: list[str]) -> str:
    return " and ".join([", ".join(words[:-1]), words[-1]] if words[1:] else words)
