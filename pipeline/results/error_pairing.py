"""The errors of two sessions, told apart: those that both share, and those that each has to itself."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from pipeline.adjustment.error_sources import OWNERS, Owner, source_of
from pipeline.maths.comparison import MountEstimate
from pipeline.maths.mount_parameters import N_MOUNT
from pipeline.results.session_estimate import NO_ERRORS, SharableErrors

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Pairing:
    """Whose errors are whose in two sessions.

    Attributes
    ----------
    common, own
        Names of the parameters whose errors both sessions share, and of those whose errors each has to itself.
    differing
        In words, what the two sessions would share (the laser's mount, the target) if it were the same in both.
    sources
        The source in words of each column of the difference's effects.
    cautious
        A result does not tell its errors apart.
    """

    common: tuple[str, ...] = ()
    own: tuple[str, ...] = ()
    differing: tuple[str, ...] = ()
    sources: tuple[str, ...] = ()
    cautious: bool = False


def paired(
    mounts: tuple[MountEstimate, MountEstimate],
    systematic: tuple[Mapping[str, SharableErrors], Mapping[str, SharableErrors]],
) -> tuple[tuple[MountEstimate, MountEstimate], Pairing]:
    """Return both estimates with their own and their common errors.

    An error is common if it belongs to the same thing in both, by the digests of all that is stated of this thing; else
    each session has its own.

    Parameters
    ----------
    mounts
        The two estimates, with noise alone.
    systematic
        The systematic errors of both, by what they belong to.
    """
    first, second = systematic
    blocks = {owner: (first.get(owner, NO_ERRORS), second.get(owner, NO_ERRORS)) for owner in OWNERS}
    common = [owner for owner, pair in blocks.items() if _is_common(*pair)]
    own = [owner for owner in OWNERS if owner not in common]
    parts = [[(owner, blocks[owner][place]) for owner in own] for place in (0, 1)]
    shared = [[(owner, blocks[owner][place]) for owner in common] for place in (0, 1)]
    before, after = (
        replace(mounts[place], own=_columns(parts[place]), common=_columns(shared[place])) for place in (0, 1)
    )
    pairing = Pairing(
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
