"""Begin a session: look into a folder of raw files, and write session.yaml and the pool's config as far as they tell.

What only a person knows is marked (:mod:`pipeline.config.fill_in`), and nothing is guessed: where files leave a choice,
all of it stands in a comment.
"""
