"""The commands of ``poolcal``, a module each.

A command's module has a function ``command(...) -> int``: it does the work, prints, and returns the exit status (0:
done; 1: done, but the answer is no). :mod:`stages.cli` declares the commands' arguments and calls it. The other modules
serve several commands: ``answer`` (what is printed at the end), ``draw``, ``one_drawing`` and ``draw_worker`` (page and
recordings), ``entry`` (from exceptions to exit status), ``laser_mount``.
"""
