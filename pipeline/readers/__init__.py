"""Readers: raw instrument files -> canonical columns. The only place that knows byte layouts, NED and UTC.

:mod:`pipeline.readers.dispatch` lists the formats, and says how another one is added. All readers share one protocol,
:class:`pipeline.artefacts.streams.Part`: a ``name``, and ``chunks()``.
"""
