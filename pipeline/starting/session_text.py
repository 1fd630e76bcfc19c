"""The text of a new session.yaml, from what was found in the folder."""

from collections.abc import Iterator

from pipeline.config.fill_in import MARK, WHAT
from pipeline.config.instruments import Sensor
from pipeline.console import plural
from pipeline.maths.mount_parameters import SETTINGS
from pipeline.readers.crs import LASER_FRAME
from pipeline.starting.figure_comments import about_comments, figure_comments
from pipeline.starting.file_groups import FileGroup
from pipeline.starting.folder_survey import FolderSurvey
from pipeline.starting.left_out_words import left_out_lines
from pipeline.starting.presets import preset_of, presets_for
from pipeline.starting.span_words import span_words
from pipeline.starting.yaml_words import beside, comment, file_list, list_in_brackets, scalar, to_fill_in

MOST_LEFT_OUT = 40  # lines with files and their reasons
_NAMES = {"ins": "the INS", "laser": "the laser", "mbes": "the sonar"}
_HEAD = (
    f"A session of poolcal, begun by poolcal init from the files in this folder. {MARK} marks what only a person "
    "knows: poolcal says what is still to be filled in. All keys, and their defaults: docs/reference/session.md."
)
_BEGINNING_OF_MBES = (
    "No sonar file was found. To calibrate the sonar add a block mbes with files, format and mount; without it poolcal "
    "laser calibrates the laser itself."
)


def session_text(survey: FolderSurvey) -> str:
    """Return the text of session.yaml; the same folder gives the same text."""
    lines = [*comment(_HEAD), *_name(survey)]
    for sensor in ("ins", "laser", "mbes"):
        lines += ["", *_sensor(sensor, survey)]
    return "\n".join([*lines, "", *about_comments(), *_left_out(survey)]) + "\n"


def _name(survey: FolderSurvey) -> Iterator[str]:
    name = survey.folder.resolve().name[:300]
    if name and name.isprintable():
        yield f"name: {scalar(name)}"


def _sensor(sensor: Sensor, survey: FolderSurvey) -> Iterator[str]:
    groups = survey.groups[sensor]
    if not groups and sensor == "mbes":
        yield from comment(_BEGINNING_OF_MBES)
        return
    yield f"{sensor}:"
    if len(groups) == 1:
        yield from _chosen(groups[0], survey)
    else:
        yield from _open(sensor, groups)
    if sensor == "ins":
        yield from _accuracy(survey)
        yield from figure_comments(sensor, has_preset=False)
        return
    if sensor == "laser" and survey.frame is not None:
        yield from _frame(survey)
    if sensor == "mbes":
        yield from _casts(survey)
    yield from _mount(sensor)
    group = survey.chosen(sensor)
    yield from figure_comments(sensor, has_preset=group is not None and preset_of(group.instrument) != "")


def _chosen(group: FileGroup, survey: FolderSurvey) -> Iterator[str]:
    yield from comment(f"{plural(len(group.files), 'file')} ({group.kind.title}), {span_words(group)}", "  ")
    yield from (line for doubt in survey.doubts if _is_about(doubt, group) for line in comment(f"Look: {doubt}", "  "))
    yield f"  files: {file_list(group.patterns)}".replace(": \n", ":\n")
    yield f"  format: {group.kind.format}"
    if group.undated and group.gps_week is None:
        yield to_fill_in("gps_week", "  ")
    elif group.undated:
        yield beside(f"  gps_week: {group.gps_week}", "the files have seconds of the week; from the other files' dates")
    yield from _instrument(group)
    if group.lacks_speed:
        yield to_fill_in("sound_speed_m_s", "  ")


def _is_about(doubt: str, group: FileGroup) -> bool:
    return any(file.name in doubt for file in group.files)


def _instrument(group: FileGroup) -> Iterator[str]:
    """Yield the preset that the files name; without one, as a comment, those to choose from."""
    preset = preset_of(group.instrument)
    if preset:
        yield beside(f"  instrument: {preset}", "the files name it; its figures are in configs/instruments")
        return
    named = f"The files name {group.instrument}, for which there is no preset. " if group.instrument else ""
    known = ", ".join(presets_for(group.sensor))
    known_if = f"If it is one of these instruments, name it; if not, leave this out: {known}"
    yield from comment(f"{named}{known_if}", "  ")
    yield "  # instrument: NAME"


def _open(sensor: Sensor, groups: tuple[FileGroup, ...]) -> Iterator[str]:
    """Yield a sensor's files and format to fill in, below a comment with all groups that there are."""
    if groups:
        several = f"Several kinds of files may be those of {_NAMES[sensor]}. Choose one, for files and format below:"
        yield from comment(several, "  ")
    else:
        yield from comment(f"No file of {_NAMES[sensor]} was found that can be read.", "  ")
    for group in groups:
        yield from comment(f"{group.kind.title}, {plural(len(group.files), 'file')}, {span_words(group)}:", "  ")
        yield f"  #   files: {list_in_brackets(group.patterns)}"
        yield f"  #   format: {group.kind.format}"
        if group.gps_week is not None:
            yield f"  #   gps_week: {group.gps_week}"
    yield to_fill_in("files", "  ")
    yield to_fill_in("format", "  ")
    if any(group.undated and group.gps_week is None for group in groups):
        yield beside("  # gps_week: NUMBER", f"{WHAT['gps_week']}; where the format chosen needs it")


def _accuracy(survey: FolderSurvey) -> Iterator[str]:
    group = survey.chosen("ins")
    if not survey.accuracy:
        return
    yield from comment("Accuracy files, which belong to an SBET:", "  ")
    if group is not None and group.kind.format == "sbet":
        yield f"  accuracy: {file_list(survey.accuracy)}".replace(": \n", ":\n")
    else:
        yield f"  #   accuracy: {list_in_brackets(survey.accuracy)}"


def _frame(survey: FolderSurvey) -> Iterator[str]:
    proposal = survey.frame
    assert proposal is not None
    yield from comment(f"frame: {proposal.why}.", "  ")
    yield to_fill_in("frame", "  ") if proposal.frame == MARK else f"  frame: {scalar(proposal.frame)}"
    if proposal.heights is not None:
        yield to_fill_in("heights", "  ")
    elif proposal.frame == MARK and proposal.frame != LASER_FRAME:
        yield beside("  # heights: ellipsoidal", WHAT["heights"])


def _casts(survey: FolderSurvey) -> Iterator[str]:
    for name in survey.casts:
        yield from comment("A cast of sound speed. Take the comment sign away to trace rays through it:", "  ")
        yield f"  # svp: {scalar(name)}"


def _mount(sensor: Sensor) -> Iterator[str]:
    yield beside("  mount:", f"{WHAT[f'{sensor}.mount']}; or by hand")
    if sensor == "mbes":
        yield from comment("At a roll of 0 the head looks down; to look to starboard its roll is -.", "    ")
    yield from (to_fill_in(key, "    ") for key in SETTINGS)


def _left_out(survey: FolderSurvey) -> Iterator[str]:
    if not survey.left_out:
        return
    yield ""
    yield "# Files that are not used, and why:"
    for line in left_out_lines(survey.left_out, MOST_LEFT_OUT):
        yield from comment(f"  {line}")
