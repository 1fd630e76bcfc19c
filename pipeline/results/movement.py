"""Has the mount moved between two sessions? Their difference, tested, and the movements that the test could show."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from pipeline.adjustment.error_sources import OWNERS, Owner, source_of
from pipeline.maths.comparison import MountDifference, MountEstimate, compare_estimates
from pipeline.maths.detectable_movement import DetectableMovement, detectable_movement
from pipeline.maths.mount_parameters import N_MOUNT
from pipeline.mount import WITHIN_95
from pipeline.results.session_estimate import NO_ERRORS, SessionEstimate, SharableErrors

Array = NDArray[np.float64]
Answer = Literal["moved", "no_movement_shown", "too_uncertain"]
SIGNIFICANCE = 0.01  # level of the joint test: the share of false alarms if no mount has moved
NOISE = "noise"
NO_TOLERANCES = np.full(N_MOUNT, np.nan)


@dataclass(frozen=True)
class Movement:
    """Comparison of two sessions, the second minus the first.

    Attributes
    ----------
    difference
        The difference and its test.
    detectable
        The least movements that the test finds.
    limits
        (6,) rad and m: the test answers nothing where a larger movement could stay unseen.
    common, own
        Names of the parameters whose errors both sessions share, and of those whose errors each has to itself.
    differing
        In words, what the two sessions would share (the laser's mount, the target) if it were the same in both.
    mostly
        For each of the six, the source in words that adds most to the variance of the difference.
    cautious
        A result does not tell its errors apart: the total covariances of both were added, as if nothing were shared.
    """

    difference: MountDifference
    detectable: DetectableMovement
    limits: Array
    common: tuple[str, ...]
    own: tuple[str, ...]
    differing: tuple[str, ...]
    mostly: tuple[str, ...]
    cautious: bool

    @property
    def moved(self) -> list[int]:
        """Indices of the parameters that have changed significantly."""
        return self.difference.significant(SIGNIFICANCE)

    @property
    def uncertain(self) -> list[int]:
        """Indices of the parameters of which a movement beyond its limit could stay unseen."""
        return np.flatnonzero(self.detectable.surely > self.limits).tolist()

    @property
    def answer(self) -> Answer:
        """Whether a movement is shown, and if not, whether one that matters could have been."""
        if self.moved:
            return "moved"
        return "too_uncertain" if self.uncertain else "no_movement_shown"


def movement_between(first: SessionEstimate, second: SessionEstimate, tolerances: Array = NO_TOLERANCES) -> Movement:
    """Return the comparison of two sessions.

    An error is common if it belongs to the same thing in both, by the digests of all that is stated of this thing; else
    each session has its own. If either session is of a version that did not write its systematic errors apart, the
    total covariances are added: then nothing cancels, and the test shows less than it could.

    Parameters
    ----------
    first, second
        The sessions.
    tolerances
        (6,) rad and m: larger movements must not stay unseen. NaN: 1.96 of the smaller total sigma that the two
        verdicts admit, because a calibration that may be wrong by as much is accepted.
    """
    estimates: tuple[MountEstimate, MountEstimate]
    if first.systematic is None or second.systematic is None:
        before, after = (replace(session.mount, covariance=session.covariance_total) for session in (first, second))
        estimates, pairing = (before, after), _Pairing(cautious=True)
    else:
        estimates, pairing = _paired((first.mount, second.mount), (first.systematic, second.systematic))
    difference = compare_estimates(*estimates)
    return Movement(
        difference=difference,
        detectable=detectable_movement(difference.covariance, SIGNIFICANCE),
        limits=np.where(np.isnan(tolerances), WITHIN_95 * np.minimum(first.limits, second.limits), tolerances),
        common=pairing.common,
        own=pairing.own,
        differing=pairing.differing,
        mostly=tuple(_largest_sources(difference, pairing.sources)),
        cautious=pairing.cautious,
    )


@dataclass(frozen=True)
class _Pairing:
    """Fields of :class:`Movement`, and the source in words of each column of the difference's effects."""

    common: tuple[str, ...] = ()
    own: tuple[str, ...] = ()
    differing: tuple[str, ...] = ()
    sources: tuple[str, ...] = ()
    cautious: bool = False


def _paired(
    mounts: tuple[MountEstimate, MountEstimate],
    systematic: tuple[Mapping[str, SharableErrors], Mapping[str, SharableErrors]],
) -> tuple[tuple[MountEstimate, MountEstimate], _Pairing]:
    """Return both estimates with their own and their common errors."""
    first, second = systematic
    blocks = {owner: (first.get(owner, NO_ERRORS), second.get(owner, NO_ERRORS)) for owner in OWNERS}
    common = [owner for owner, pair in blocks.items() if _is_common(*pair)]
    own = [owner for owner in OWNERS if owner not in common]
    parts = [[(owner, blocks[owner][place]) for owner in own] for place in (0, 1)]
    shared = [[(owner, blocks[owner][place]) for owner in common] for place in (0, 1)]
    before, after = (
        replace(mounts[place], own=_columns(parts[place]), common=_columns(shared[place])) for place in (0, 1)
    )
    pairing = _Pairing(
        common=_parameters(shared[0]),
        own=_parameters([*parts[0], *parts[1]]),
        differing=tuple(OWNERS[owner] for owner in own if owner != "session" and any(e.effects for e in blocks[owner])),
        sources=tuple(word for side in (*parts, shared[0]) for block in side for word in _sources(*block)),
    )
    return (before, after), pairing


def _parameters(blocks: Sequence[tuple[Owner, SharableErrors]]) -> tuple[str, ...]:
    return tuple(dict.fromkeys(name for _, errors in blocks for name in errors.effects))


def _is_common(first: SharableErrors, second: SharableErrors) -> bool:
    return first.stated is not None and first.stated == second.stated and list(first.effects) == list(second.effects)


def _columns(blocks: Sequence[tuple[Owner, SharableErrors]]) -> Array:
    return np.hstack([np.zeros((N_MOUNT, 0)), *(errors.independent() for _, errors in blocks)])


def _sources(owner: Owner, errors: SharableErrors) -> list[str]:
    """Return the source in words of each column; errors that correlate are one source."""
    if errors.correlation is not None:
        return [OWNERS[owner]] * len(errors.effects)
    return [source_of(name).words for name in errors.effects]


def _largest_sources(difference: MountDifference, sources: Sequence[str]) -> Iterator[str]:
    """Yield for each of the six the source with the largest part of its variance; ``noise`` is one of them."""
    squares = difference.effects**2
    for k in range(N_MOUNT):
        parts = {NOISE: float(difference.covariance[k, k] - squares[k].sum())}
        for word, square in zip(sources, squares[k].tolist(), strict=True):
            parts[word] = parts.get(word, 0.0) + square
        yield max(parts, key=lambda word: parts[word])
