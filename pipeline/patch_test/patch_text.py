"""The outcome of a patch test as text for the screen: the angles, what the passes do not see, and how a run agrees."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.console import plural
from pipeline.language.chosen import translated
from pipeline.maths.mount_parameters import PARAMETERS
from pipeline.mount import Mounted, setting_change
from pipeline.patch_test.solve import UNEXPLAINED, PatchTest
from pipeline.text_table import text_table, wrapped

Array = NDArray[np.float64]
ANGLES = PARAMETERS[:3]
MOST_NAMED = 2  # contradictions: one error often moves several estimates
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
            for name, place, key, _ in ANGLES
            if found.seen[place]
        }

    def agrees(self, found: PatchTest) -> bool:
        """Return whether no angle differs by more than chance explains."""
        return all(abs(apart) <= AGREE * sigma for apart, sigma in self.differences(found).values())


def patch_text(found: PatchTest, beside: Compared, read: int) -> str:
    """Return the text; ``read``: the number of all soundings."""
    settings, sigmas = found.mount.settings(), found.mount.sigmas(found.covariance)
    differences, rows = beside.differences(found), []
    for name, place, key, _ in ANGLES:
        cells = [f"{translated(name)} °", f"{beside.settings[key]:.4f}"]
        cells += [f"{settings[key]:.4f}", f"{sigmas[key]:.4f}"] if found.seen[place] else ["not seen", ""]
        if name in differences:
            apart, sigma = differences[name]
            cells += [f"{apart:+.4f}", f"{abs(apart) / sigma:.1f}"]
        rows.append(cells)
    heads = ["", beside.words, "patch test", "sigma"]
    heads += ["difference", "in its sigmas"] if beside.covariance is not None else []
    pieces = len(found.pieces) + len(found.refused)
    return "\n".join(
        [
            f"Patch test of {plural(found.passes, 'pass')}: {len(found.pieces)} of {pieces} pieces of the bottom are "
            f"used, with {found.used:,} of {read:,} soundings.",
            "",
            *text_table("  <9>14>12>10>12>15", heads, rows),
            "",
            *(row for sentence in _sentences(found, beside) for row in wrapped(sentence)),
        ]
    )


def _sentences(found: PatchTest, beside: Compared) -> list[str]:
    unseen = [name for name, place, _, _ in ANGLES if not found.seen[place]]
    arm_mm = ", ".join(f"{1000 * sigma:.0f}" for sigma in np.sqrt(np.diag(found.known)[3:]))
    said = [
        f"The lever arm is not seen by such passes: x, y, z stay as they are. Their sigmas ({arm_mm} mm) are in those "
        "of the angles."
    ]
    if unseen:
        said.append(
            f"Not seen: {', '.join(unseen)}. Sail both ways, side by side, over a slope: roll needs a bottom that is "
            "heard both ways, pitch and yaw need a slope along the passes, yaw at different distances aside."
        )
    said += [f"The soundings contradict session.yaml: {words}." for words in found.contradicted[:MOST_NAMED]]
    if found.factor > UNEXPLAINED:
        said.append(
            f"The passes disagree by {np.sqrt(found.factor):.1f} times what the sigmas in session.yaml explain, and so "
            "the sigmas are larger by that: tide or heave between them, or the sound speed."
        )
    if found.doubtful:
        said.append("Do not use these angles before that is mended.")
    if not found.settled:
        said.append("The result still changes by half a sigma with the pieces: sail more passes.")
    if beside.covariance is not None and len(unseen) < len(ANGLES):
        said.append(
            f"{beside.words} and the passes agree." if beside.agrees(found) else
            f"{beside.words} and the passes do not agree: do not enter these angles before you know why."
        )  # fmt: skip
    return said


def of_coarse(mount: Mounted) -> Compared:
    """Return the coarse mount of session.yaml, to be shown beside the result."""
    return Compared("session.yaml", mount.settings(), None)
