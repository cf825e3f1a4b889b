"""Parameters of Newton's method for contact and flow; all else follows from the problem."""

# Relative residual at which GMRES ends in Newton's step: a tenth is left. As little of an error
# counts elsewhere: the triangles that hold the last tenth of it stay as they are, and difficult
# stages are solved to a tenth of what is allowed. Solves within a step, and λ, on which the
# estimated error rests, are exact to powers of it.
FORCING = 0.1
# Steps of Newton's method in a stage, and of GMRES in a step: most scenes need two to five. Half as
# many stages.
MOST_STEPS = 20
# Parts of a side of the patch, in each of which errors have a sign of their own.
PARTS = 4
# Nodes of the first network for the fluid's pressure, but every fourth sample at least: little
# beside one contact. Of the last one, at about 1 kB each.
FIRST_NODES, MOST_NODES = 30_000, 2_000_000
# Part of the rms height by which heights between the samples of a thinned problem may err: four
# samples in the shortest wave lose 0.02 to 0.04, two 0.06 to 0.13.
THINNED = 0.04
