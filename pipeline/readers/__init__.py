"""Readers turn raw instrument files into canonical columns.

Apart from the simulator, only this package knows byte layouts, NED axes (north, east, down) and sonar times in UTC.
Canonical columns are those of stage ingest's tables and streams, in SI units and with times in GPS nanoseconds.
:mod:`pipeline.readers.dispatch` lists the formats, and says how a new format is added. All readers fulfil one protocol,
:class:`pipeline.artefacts.streams.Part`: a part has a ``name``, and its ``chunks()`` yields the rows batch by batch.
"""
