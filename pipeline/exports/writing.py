"""Write a mount for a program as text, and read it back: what holds for all targets."""

from dataclasses import replace

from pipeline.config.mount import Mount
from pipeline.config.yaml_models import parse
from pipeline.errors import ConfigError
from pipeline.exports.mounting import Mounting, VesselFrame
from pipeline.exports.order_check import refuse_spread, stated_order
from pipeline.exports.target import Options, Target
from pipeline.mount import Mounted, mount_of


def export_text(target: Target, mounting: Mounting, options: Options) -> str:
    """Return a mount as a program's text.

    Raises
    ------
    ConfigError
        An option does not belong to the program, or the order of its rotations is not known and matters, or the run was
        rejected and the form has no place to say so.
    """
    target.check(options)
    target.check_frame(mounting)
    if mounting.origin.rejected is not None and not target.has_marks:
        raise ConfigError(
            f"--although-rejected: the form of {target.name} has no place that says that the run was rejected; export "
            "it "
            "to json, or type the values by hand"
        )
    placed = replace(mounting, frame=frame_of(target, mounting.frame, options))
    refuse_spread(target, placed.vessel.R_body_from_sensor, options)
    return target.write(target, placed, options)


def frame_of(target: Target, frame: VesselFrame, options: Options) -> VesselFrame:
    """Return the frame in which a program counts: with a height of the INS above the water, z counts from the water."""
    if options.ins_height_m is None or target.counts_from != "water":
        return frame
    x, y, _ = frame.ins_point_m
    return replace(frame, ins_point_m=(x, y, options.ins_height_m))


def mount_in(target: Target, text: str, where: str, told: VesselFrame | None, options: Options) -> Mounted:
    """Return the mount on the INS's body that a program's file holds.

    Parameters
    ----------
    target
        The program.
    text, where
        The file's text, and its name for messages.
    told
        The vessel's frame as told by the user; None: as the file states it, or the INS's own.
    options
        What the user told of the program.

    Raises
    ------
    ConfigError
        The file is not the program's, is cut off, has two heads, or holds what cannot be a mount.
    """
    target.check(options)
    stated = VesselFrame.stated_in(text, where)
    if told is not None or options.ins_height_m is not None:
        told = frame_of(target, told or VesselFrame(), options)
        if stated is not None and stated != told:
            raise ConfigError(
                f"{where}: states another place or turn of the INS than the options do; leave the options out"
            )
    frame = stated or told or VesselFrame()
    if target.counts_from == "ins" and not frame.is_ins:
        raise ConfigError(f"--ins-point, --ins-turn: {target.name} counts from the INS itself; leave them out")
    options = replace(options, order=stated_order(text, target, where, options))
    vessel = target.read(target, text, where, options)
    refuse_spread(target, vessel.R_body_from_sensor, options)
    return mount_of(parse(Mount, frame.to_body(vessel).settings(), where))
