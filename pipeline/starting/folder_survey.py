"""What a folder of raw files tells about a session: each sensor's files, casts, accuracy files, and files left out."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from pipeline.atomic_files import temporary_folder
from pipeline.checking.file_checks import duplicate_files
from pipeline.checking.file_survey import SENSORS
from pipeline.config.instruments import Sensor
from pipeline.errors import RawDataError
from pipeline.readers.casts import read_cast
from pipeline.starting.boat_track import BoatTrack, boat_track
from pipeline.starting.file_groups import FileGroup, survey_group
from pipeline.starting.file_patterns import patterns_for
from pipeline.starting.folder_files import LeftOut, sort_files
from pipeline.starting.laser_frame import FrameProposal, propose_frame
from pipeline.starting.two_sessions import two_session_doubts
from pipeline.starting.weeks import with_weeks


@dataclass(frozen=True)
class FolderSurvey:
    """What was found in a folder.

    Attributes
    ----------
    folder : Path
        The folder.
    groups : mapping
        By sensor the groups of its files, one for each kind. With more than one nothing is chosen.
    accuracy : tuple of str
        Patterns of accuracy files (SMRMSG).
    casts : tuple of str
        Names of casts of sound speed.
    left_out : tuple of LeftOut
        Files that are not used, in order of their names.
    doubts : tuple of str
        Sentences about files of the session that a person should look at.
    track : BoatTrack or None
        Where the boat was; None without a chosen INS.
    frame : FrameProposal or None
        The frame of the laser's points; None without a chosen laser.
    """

    folder: Path
    groups: Mapping[Sensor, tuple[FileGroup, ...]]
    accuracy: tuple[str, ...]
    casts: tuple[str, ...]
    left_out: tuple[LeftOut, ...]
    doubts: tuple[str, ...]
    track: BoatTrack | None
    frame: FrameProposal | None

    def chosen(self, sensor: Sensor) -> FileGroup | None:
        """Return the files of a sensor; None if there are none, or if there is a choice."""
        groups = self.groups[sensor]
        return groups[0] if len(groups) == 1 else None


def survey_folder(folder: Path) -> FolderSurvey:
    """Return what a folder holds; only heads and samples of large files are read."""
    files = sort_files(folder)
    left_out, found = list(files.left_out), list[FileGroup]()
    with temporary_folder() as copies:
        for sensor in SENSORS:
            for title in sorted(title for of, title in files.by_kind if of == sensor):
                names = files.by_kind[sensor, title]
                group, unusable = survey_group(sensor, files.kinds[title], names, folder, copies)
                left_out += unusable
                found += [] if group is None else [group]
    found = with_weeks(found)
    groups = {sensor: tuple(group for group in found if group.sensor == sensor) for sensor in SENSORS}
    one = {sensor: several[0] for sensor, several in groups.items() if len(several) == 1}
    track = boat_track(one["ins"].files) if "ins" in one else None
    casts = [text.name for text in files.texts if _is_cast(folder, text.name)]
    left_out += [text for text in files.texts if text.name not in casts]
    twice = (finding.words for group in one.values() for finding in duplicate_files(group.files))
    return FolderSurvey(
        folder=folder,
        groups=groups,
        accuracy=tuple(patterns_for(files.accuracy, folder)),
        casts=tuple(casts),
        left_out=tuple(sorted(left_out)),
        doubts=(*twice, *two_session_doubts(one)),
        track=track,
        frame=propose_frame(one["laser"], folder, track) if "laser" in one else None,
    )


def _is_cast(folder: Path, name: str) -> bool:
    try:
        read_cast(folder / name, name)
    except RawDataError as error:
        return "give mbes.svp_number" in str(error)
    return True
