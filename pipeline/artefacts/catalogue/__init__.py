"""Every table that a stage writes, two stages a module: owner, name, columns, units."""
