"""Constants of Newton's method for contact and flow; all else follows from the problem."""

# Relative residual at which GMRES ends in Newton's step. Those of the solves within it, and of λ,
# on which the estimated error rests, are powers of it.
FORCING = 0.1
# Stages; half as many in a row with a sealed film, since ε is then 1/256 of the first, and a film
# that so little ε has not opened says no more with less. Steps of Newton's method in a stage, and
# of GMRES in a step: most scenes need two to five.
MOST_STAGES, MOST_STEPS = 10, 20
# ε of the first stage in rms heights: p_f is then a smooth function of a gap next to closing.
FIRST_EPSILON = 1e-2
# Part of the estimated error of ln Q on whose triangles those of the next stage are smaller
# (Dörfler).
MARKED = 0.9
# Part of the allowed error of ln Q that counts as none: difficult stages are solved to it, and no
# claim is below it.
LEAST = 0.1
# Parts of a side of the patch, in each of which errors have a sign of their own.
PARTS = 4
# Nodes of the first network for the fluid's pressure, but every fourth sample at least: little
# beside one contact. Of the last one, at about 1 kB each.
FIRST_NODES, MOST_NODES = 30_000, 2_000_000
