"""Flow solver of the 2012 letter: central differences on the samples, independent of `flow`."""

from fem_seal.finite_difference.solver import by_differences
