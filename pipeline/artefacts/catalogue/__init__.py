"""Descriptions of all tables and streams: owner, name, columns, units. Each module has the tables of two stages."""
