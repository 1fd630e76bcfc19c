"""Refuse numbers for a program whose order of rotations is not known, if the order matters for this mount."""

import re

import numpy as np
from numpy.typing import NDArray

from pipeline.errors import ConfigError
from pipeline.exports.orders import ORDERS, OURS, errors_by_order
from pipeline.exports.target import Options, Target

Array = NDArray[np.float64]
MOST_SPREAD_DEG = 0.02  # 10 mm at 30 m


def refuse_spread(target: Target, R: Array, options: Options) -> None:
    """Raise a ConfigError if an unknown order can turn the mount R (3, 3) by more than MOST_SPREAD_DEG."""
    if target.convention.order is not None or options.order is not None:
        return
    worst = max(errors_by_order(R, OURS).values())
    if worst > MOST_SPREAD_DEG:
        raise ConfigError(
            f"--order: is needed: the maker does not state the order in which {target.name} turns by heading, pitch "
            "and "
            f"roll, and for this mount a wrong one is {worst:.2f}° off ({order_table(R, OURS)}); ask the maker, or "
            "find it "
            f"with a patch test, and give --order {OURS} or another"
        )


def spread_sentence(R: Array, options: Options) -> str:
    """Return the sentence on what a wrong order costs for the mount R (3, 3)."""
    if options.order is None:
        return (
            f"The maker does not state the order: {OURS} is assumed. Another one is off by {order_table(R, OURS)}: at "
            "most "
            f"{MOST_SPREAD_DEG}°, else this is refused."
        )
    return f"The order is as told by --order. If it is another, the mount is off by {order_table(R, options.order)}."


def order_table(R: Array, printed: str) -> str:
    """Return the errors of the other five orders as text."""
    errors = errors_by_order(R, printed)
    return ", ".join(f"{order} {error:.3f}°" for order, error in errors.items() if order != printed)


def stated_order(text: str, target: Target, where: str, options: Options) -> str | None:
    """Return the order of rotations that a text of poolcal's states, or the one told by the user.

    Parameters
    ----------
    text, where
        The text, and its file for messages.
    target, options
        The program, and what the user told.
    """
    stated = set(re.findall(r"Order of rotations: ([YPR]{3})\b", " ".join(text.split()))) & set(ORDERS)
    if target.convention.order is not None or not stated:
        return options.order
    if len(stated) > 1 or (options.order is not None and {options.order} != stated):
        raise ConfigError(f"{where}: states the order {', '.join(sorted(stated))}; leave --order out, or export again")
    return str(stated.pop())
