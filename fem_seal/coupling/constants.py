"""Parameters of Newton's method for contact and flow; all else follows from the problem."""

# An inner solve leaves a tenth of the error that the outer one leaves: GMRES a tenth of F in
# Newton's step, the tangents of contact and flow a tenth of that. λ, which measures the errors of
# steps, has a tenth of theirs; and the stages of a thinned problem, or after difficult steps, end
# at a tenth of the error that is allowed.
INNER = 0.1
# Steps of Newton's method in a stage, and of GMRES in a step: most scenes need two to five. Half as
# many stages.
MOST_STEPS = 20
# Part of the pressure drop by which a step leads away from an unstable equilibrium.
FAR = 0.1
# Stages in a row without an equilibrium after which finer ones are not tried. Where up to four had
# none, a later one had.
MOST_FAILED = 5
# Parts of a side of the patch, in each of which errors have a sign of their own.
PARTS = 4
# Part of the error of the network that the triangles hold that are halved.
HALVED = 0.9
# Part of the allowed error of ln Q by which a channel along diagonals may change it: many may open.
DIAGONAL = 0.01
# Least part of the allowed error of ln Q that is claimed: the contacts are no more exact.
LEAST = 0.1
# Nodes of the first network for the fluid's pressure, but every fourth sample at least: little
# beside one contact. Of the last one, at about 1 kB each.
FIRST_NODES, MOST_NODES = 30_000, 2_000_000
# Part of the rms height by which heights between the samples of a thinned problem may err: four
# samples in the shortest wave lose 0.02 to 0.04, two 0.06 to 0.13.
THINNED = 0.04
