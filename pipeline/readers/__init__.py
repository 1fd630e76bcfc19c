"""Readers: raw instrument files -> canonical columns. The only place that knows byte layouts, NED and UTC."""
