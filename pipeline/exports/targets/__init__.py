"""Forms of other programs, one module a program; :mod:`pipeline.exports.registry` lists them."""
