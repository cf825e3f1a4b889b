"""Numbers that rule Newton's method for contact and flow."""

# An inner solve leaves a tenth of what the outer one leaves:
# * GMRES leaves a tenth of F in Newton's step, the tangents of contact and flow a tenth of that;
# * λ, which measures the errors of steps, has a tenth of theirs;
# * the stages of a thinned problem, or after difficult steps, end at a tenth of the allowed error;
# * the triangles that are not halved hold a tenth of the network's error;
# * a tenth of the allowed error is the least that is claimed: contacts are no more exact.
INNER = 0.1
# Steps of Newton's method in a stage, and of GMRES in a step: most scenes need two to five. Half as
# many stages.
MOST_STEPS = 20
# After so many stages without an equilibrium no finer one is tried. In one scene six had none,
# and the seventh had.
MOST_FAILED = 8
# Parts of a side of the patch, in each of which errors have a sign of their own.
PARTS = 4
# Part of the allowed error of ln Q by which a channel along diagonals may change it: many may open.
DIAGONAL = 0.01
# ε over the rms height with which a film must be sealed: with a larger one on a coarse network the
# fluid may not reach a channel that it would open.
SEALED = 5e-4
# Samples of the first contact, and nodes of the first network, but every fourth sample at least:
# little beside one contact. Nodes of the last network, at about 1 kB each.
FIRST_NODES, MOST_NODES = 30_000, 2_000_000
