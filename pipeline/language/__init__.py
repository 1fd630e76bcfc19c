"""The language that people read: English, or another by a catalogue of sentences.

The program makes all text in English. What people read is translated at the end, as it is printed, or written into a
page or a picture: texts come from tables and from calibration.json too, where they stay English, because programs and
other people read them. A sentence is found by its English words, with the values in it
(:mod:`pipeline.language.matching`).
"""
