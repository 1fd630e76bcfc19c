"""``poolcal view``: a run's recordings, or two runs side by side, in the Rerun viewer."""

from pathlib import Path

from pipeline.atomic_files import temporary_folder
from pipeline.errors import ConfigError
from pipeline.run.settings import read_settings
from stages import ORDER
from stages.commands.answer import say_failures
from stages.commands.diff import comparison, save_pair
from stages.commands.draw import Painters
from stages.views.recording import recordings_of
from stages.views.viewer import show_recordings


def view(first: Path, second: Path | None, stage: str | None) -> int:
    """The exit status, once the viewer is closed; ``stage``: of one run, that stage's recording alone."""
    if stage is not None and stage not in ORDER:
        raise ConfigError(f"--stage {stage!r}: is no stage; the stages are {', '.join(ORDER)}")
    if second is None:
        read_settings(first)
        say_failures(Painters(report=False, recordings=True).draw(first))
        copy = f"copy {first}/*/*.rrd to a machine with one, or open {first}/report/report.html"
        return show_recordings(recordings_of(first, stage), copy)
    if stage is not None:
        raise ConfigError(f"--stage {stage}: two runs are shown as a whole; leave it out, or name one run")
    with temporary_folder() as place:
        path = place / "pair.rrd"
        save_pair(first, second, comparison(first, second), path)
        copy = f"write both by poolcal diff {first} {second} --rrd FILE, and copy that to a machine with one"
        return show_recordings([path], copy)
