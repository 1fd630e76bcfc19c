"""The Rerun viewer, opened for the user: on this machine's display, heard by this machine alone, telling nobody."""

import contextlib
import json
import os
import subprocess
import sys
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from pipeline.atomic_files import temporary_folder
from pipeline.console import say
from pipeline.errors import ArtefactError

DISPLAYS = ("DISPLAY", "WAYLAND_DISPLAY", "WAYLAND_SOCKET")
NO_WINDOW = ("winit", "EventLoop", "DISPLAY")  # one of these is in what the viewer says where no window can be opened


def show(paths: Sequence[Path], instead: str) -> int:
    """The viewer, until it is closed. ``instead``: what one can do where there is no display."""
    no_display = ArtefactError(f"no display here: {instead}")
    if sys.platform == "linux" and not any(map(os.environ.get, DISPLAYS)):
        raise no_display
    viewer = Path(sys.executable).with_name("rerun")
    places = [str(path.absolute()) for path in paths]
    try:
        with (
            temporary_folder() as place,
            silent() as environment,
            (place / "told").open("w+", encoding="utf-8", errors="replace") as told,
        ):
            command = [str(viewer), "--bind", "127.0.0.1", *places]
            status = subprocess.run(command, check=False, env=environment, stderr=told).returncode
            told.seek(0)
            said = told.read()
    except FileNotFoundError as error:
        raise ArtefactError(f"{viewer}: there is no such program; run make setup again") from error
    if status and any(word in said for word in NO_WINDOW):
        raise no_display
    if status:
        say(said.rstrip(), sys.stderr)
    return status and 1


@contextlib.contextmanager
def silent() -> Iterator[Mapping[str, str]]:
    """An environment in which the viewer sends no usage statistics, whatever the user has chosen for other programs.

    The viewer knows no option and no variable for that, only its file analytics.json: it is given one of its own, and
    the user's is neither read nor written.
    """
    with temporary_folder() as place:
        file = place / "rerun" / "analytics.json"
        file.parent.mkdir()
        given = {"analytics_enabled": False, "analytics_id": "none", "metadata": {}}
        given |= {"config_file_path": str(file), "data_dir_path": str(file.parent)}
        file.write_text(json.dumps(given), encoding="utf-8")
        yield os.environ | {"XDG_CONFIG_HOME": str(place)}
