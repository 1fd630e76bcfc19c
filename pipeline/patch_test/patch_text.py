"""The outcome of a patch test as text for the screen: the angles, what the passes do not see, and how a run agrees."""

import re
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.console import plural
from pipeline.language.chosen import translated
from pipeline.maths.mount_parameters import PARAMETERS
from pipeline.mount import Mounted, setting_change
from pipeline.patch_test.bottom_seen import BottomSeen
from pipeline.patch_test.solve import DIFFERING, FEWEST, UNEXPLAINED, PatchTest
from pipeline.text_table import text_table, wrapped

Array = NDArray[np.float64]
ANGLES = PARAMETERS[:3]
NEEDS = {
    "roll": "Roll is not seen: sail both ways over the same bottom.",
    "pitch": "Pitch is not seen: sail over a slope that rises along the passes.",
    "yaw": "Yaw is not seen: sail over a slope that rises along the passes, at different distances from it.",
}
AGREE = 3.3  # sigmas of the difference: chance exceeds it once in a thousand


@dataclass(frozen=True)
class Compared:
    """A mount from elsewhere beside that by passes: its words, its settings, and its total covariance (6, 6)."""

    words: str
    settings: Mapping[str, float]
    covariance: Array | None  # None: of a coarse mount, which is no result

    def differences(self, found: PatchTest) -> dict[str, tuple[float, float]]:
        """Return by angle that the passes see its difference, passes less this, and the sigma of that, degrees."""
        if self.covariance is None:
            return {}
        sigmas = found.mount.sigmas(found.covariance + self.covariance)
        settings = found.mount.settings()
        return {
            name: (setting_change(settings, self.settings, key), sigmas[key])
            for name, _, key, _ in ANGLES
            if found.sees(key)
        }

    def agrees(self, found: PatchTest) -> bool:
        """Return whether there are angles to be compared, and none differs by more than chance explains."""
        differences = self.differences(found).values()
        return bool(differences) and all(abs(apart) <= AGREE * sigma for apart, sigma in differences)


def patch_text(found: PatchTest, beside: Compared, read: int) -> str:
    """Return the text; ``read``: the number of all soundings."""
    settings, sigmas = found.mount.settings(), found.mount.sigmas(found.covariance)
    differences, rows = beside.differences(found), []
    for name, _, key, _ in ANGLES:
        cells = [f"{translated(name)} °", f"{beside.settings[key]:.4f}"]
        cells += [f"{settings[key]:.4f}", f"{sigmas[key]:.4f}"] if found.sees(key) else ["not seen", ""]
        if name in differences:
            apart, sigma = differences[name]
            cells += [f"{apart:+.4f}", f"{abs(apart) / sigma:.1f}"]
        rows.append(cells)
    heads = ["", beside.words, "patch test", "sigma"]
    heads += ["difference", "in sigmas of the difference"] if beside.covariance is not None else []
    seen = found.seen
    return "\n".join(
        [
            f"Patch test of {plural(found.passes, 'pass')}, of {found.sailed} that were sailed: {len(seen.pieces)} of "
            f"{len(seen.pieces) + len(seen.others)} pieces of the bottom are used, with {len(seen.rows):,} of {read:,} "
            "soundings.",
            *_refused(seen),
            "",
            *text_table("  <9>14>12>10>12>25", heads, rows),
            "",
            *(row for sentence in _sentences(found, beside) for row in wrapped(sentence)),
        ]
    )


def _refused(seen: BottomSeen) -> list[str]:
    """Return a line with the number of refused pieces by reason, without sizes; none if none are."""
    whole = [piece.refused for piece in seen.others if piece.refused]
    reasons = Counter("heard in part" if one.startswith("only") else re.split(r",| by ", one)[0] for one in whole)
    told = "; ".join(f"{translated(reason)}: {number}" for reason, number in reasons.most_common())
    return [f"Refused: {told}."] if told else []


def _sentences(found: PatchTest, beside: Compared) -> list[str]:
    unseen = [name for name, _, key, _ in ANGLES if not found.sees(key)]
    arm_mm = ", ".join(f"{1000 * sigma:.0f}" for sigma in np.sqrt(np.diag(found.known)[3:]))
    said = [
        f"The lever arm is not seen by such passes: x, y, z stay as they are, and the angles belong to them. Their "
        f"sigmas ({arm_mm} mm) are in those of the angles.",
        *(NEEDS[name] for name in unseen),
        *_doubts(found),
    ]
    if found.drift and not found.contradicted:
        said.append(f"But {found.drift}.")
    if beside.covariance is None or found.doubtful:
        return said
    if len(unseen) == len(ANGLES):
        return [*said, f"No angle is seen: nothing of {beside.words} can be compared."]
    if beside.agrees(found):
        return [*said, f"{beside.words} and the passes agree."]
    return [*said, f"{beside.words} and the passes do not agree: do not enter these angles before you know why."]


def _doubts(found: PatchTest) -> list[str]:
    """Return sentences on what is wrong, if something is."""
    words = [f"The soundings contradict session.yaml: {cause}." for cause in found.contradicted[:1]]
    words += [f"Or, nearly as likely: {cause}." for cause in found.contradicted[1:]]
    if found.factor > UNEXPLAINED:
        words.append(
            f"The passes disagree by {np.sqrt(found.factor):.1f} times what the sigmas in session.yaml explain, and so "
            "the sigmas are larger by that: tide or heave between them, or the sound speed."
        )
    if found.seen.differing > DIFFERING:
        words.append(
            f"On {100 * found.seen.differing:.0f} % of the flat squares the passes differ by too much: a tide, a jump "
            "of the heights, or heave."
        )
    if not found.settled:
        words.append("The result still changes by half a sigma with the pieces: sail more passes.")
    if len(found.seen.pieces) < FEWEST:
        words.append("So few pieces are no patch test: sail slowly, both ways, over more of a flat bottom.")
    if found.doubtful and found.with_cast:
        words.append("Look at the cast and at --water-height first, from which its depths count.")
    return [*words, "Do not use these angles before that is mended."] if words else []


def of_coarse(mount: Mounted) -> Compared:
    """Return the coarse mount of session.yaml, to be shown beside the result."""
    return Compared("session.yaml", mount.settings(), None)
