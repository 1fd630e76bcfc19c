"""Compiled loops, where numpy needs many passes over memory or many calls on small matrices."""
