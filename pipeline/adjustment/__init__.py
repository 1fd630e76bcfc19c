"""The computations of stage adjust: observations of labelled points, the iteration, and the tables of results."""
