"""Readers turn raw instrument files into canonical columns. Beside the simulator they alone know byte layouts and NED.

Canonical columns are those of stage ingest's tables and streams, in SI units and with times in GPS nanoseconds.
:mod:`pipeline.readers.dispatch` lists the formats, and says how a new format is added. All readers fulfil one protocol,
:class:`pipeline.artefacts.streams.Part`: a part has a ``name``, and its ``chunks()`` yields the rows batch by batch.
"""
