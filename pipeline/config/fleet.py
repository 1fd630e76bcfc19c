"""FLEET.yaml: the sessions that ``poolcal repeat`` keeps up to date, with their configs and run folders."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import yaml
from pydantic import Field, model_validator

from pipeline.config.quantities import PRINTABLE, Model
from pipeline.config.session import Calibrated
from pipeline.config.yaml_file import YamlFile, compose, line_of
from pipeline.config.yaml_models import parse
from pipeline.errors import ConfigError

PathText = Annotated[str, Field(min_length=1, max_length=4000), PRINTABLE]


class ListedSession(Model):
    """An entry of the list: a session folder, or a pattern of such folders, and what they are calibrated with.

    All paths count from the folder of FLEET.yaml.
    """

    session: PathText
    config: PathText
    runs: PathText | None = None  # the run folder is runs/<name of the session folder>; null: as for all sessions
    run: PathText | None = None  # the run folder itself, for one session
    sensor: Calibrated = "mbes"

    @model_validator(mode="after")
    def _one_place(self) -> "ListedSession":
        if self.run is not None and self.runs is not None:
            raise ValueError("has both run and runs; keep one of the two")
        return self


class Fleet(Model):
    """FLEET.yaml."""

    runs: PathText | None = None  # for sessions that have neither run nor runs of their own
    sessions: Annotated[tuple[ListedSession, ...], Field(min_length=1, max_length=1000)]


@dataclass(frozen=True)
class FleetFile:
    """FLEET.yaml, checked, with the lines of its entries."""

    path: Path
    fleet: Fleet
    root: yaml.Node

    def line(self, number: int) -> int:
        """Return the line of an entry of ``sessions``; ``number`` counts from 0."""
        return line_of(self.root, ("sessions", number))

    def fault(self, number: int, key: str, words: str) -> ConfigError:
        """Return the error about a key of an entry: file, line, key and value, and ``words`` with the remedy."""
        place, value = ("sessions", number, key), getattr(self.fleet.sessions[number], key)
        shown = "" if value is None else f" = {value!r}"
        return ConfigError(f"{self.path}: line {line_of(self.root, place)}: sessions.{number}.{key}{shown}: {words}")


def load_fleet(path: Path) -> FleetFile:
    """Return the list of sessions, checked; the folders that it names are not looked at."""
    file = YamlFile.read(path)
    root = compose(file.text, path)
    return FleetFile(path, parse(Fleet, file.content, str(path), root), root)
