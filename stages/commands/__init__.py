"""The commands of ``poolcal``, one module for each.

A command's module has a function ``command(...) -> int``, which does the work, prints, and returns the exit status (0:
done; 1: done, but the answer is no). :mod:`stages.cli` declares the command's arguments and calls this function.

Six modules are no commands, but serve them: ``answer`` (the lines printed at the end), ``draw``, ``one_drawing`` and
``draw_worker`` (the report's page and the recordings), ``entry`` (exit status and interrupts), and ``laser_mount``.
"""
