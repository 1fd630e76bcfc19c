"""The list of all programs that a mount can be written for."""

from pipeline.errors import ConfigError
from pipeline.exports.cloud import CLOUDS
from pipeline.exports.target import Target
from pipeline.exports.targets import (
    caris,
    caris_hvf,
    generic,
    hypack,
    kluster,
    kongsberg,
    mbes_lib,
    mbsystem,
    novatel,
    pdal,
    posmv,
    qps,
    ros,
    xsf,
)
from pipeline.text_table import text_table

TARGETS = {
    target.name: target
    for target in (
        qps.QINSY, qps.QIMERA, kluster.TARGET, kongsberg.TARGET, posmv.TARGET, caris.TARGET, caris_hvf.TARGET,
        hypack.TARGET, mbsystem.TARGET, novatel.TARGET, ros.TARGET, pdal.TARGET, mbes_lib.TARGET, xsf.TARGET,
        generic.JSON, generic.YAML, generic.CSV,
    )
}  # fmt: skip


def target_named(name: str, option: str) -> Target:
    """Return a program by its name; raise ConfigError if there is none. ``option``: the one that names it."""
    if name not in TARGETS:
        known = ", ".join((*TARGETS, *CLOUDS)) if option == "--to" else ", ".join(TARGETS)
        raise ConfigError(f"{option} {name}: is no program known here; the programs are {known}")
    return TARGETS[name]


def list_text() -> str:
    """Return a table of all programs: name, program, what is written, certainty."""
    rows = [
        (target.name, target.title, target.writes, target.convention.certainty + _order_words(target))
        for target in TARGETS.values()
    ]
    rows += [(name, words, "calibrated points", "") for name, words in CLOUDS.items()]
    heads = ("--to", "program", "what is written", "certainty of axes, signs, order")
    return "\n".join(text_table("<10  <20  <20  <10", heads, rows))


def _order_words(target: Target) -> str:
    return "; order not stated" if target.convention.order is None else ""
