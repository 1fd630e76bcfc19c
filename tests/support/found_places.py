"""The target that a simulated session's laser points show."""

from pipeline.artefacts.streams import MemoryPart, Stream
from pipeline.config.session import SessionConfig
from pipeline.config.yaml_models import parse
from pipeline.finding.find import find_place
from pipeline.finding.place import FoundPlace
from pipeline.simulation.session import SimulatedSession


def found(session: SimulatedSession, depth_m: float = 4.0) -> FoundPlace:
    """Return it."""
    settings = parse(SessionConfig, session.session, "session")
    ins, laser = Stream((MemoryPart("ins", session.ins),)), Stream((MemoryPart("laser", session.laser),))
    return find_place(ins, laser, settings, depth_m)
