"""What Newton's method for contact and flow takes as given; all else follows from the problem."""

# What a linear solve leaves of its right side, a step of the solid's load, and a refinement of what
# may err: Newton's method repeats each of them, and less would cost more than one more step.
PART = 0.1
# Stages; half as many in a row with a sealed film, since ε is then 1/256 of the first, and a film
# that so little ε has not opened says no more with less. Steps of Newton's method in a stage, and
# of GMRES in a step: most scenes need two to five.
MOST_STAGES, MOST_STEPS = 10, 20
# Divisor of ε from stage to stage: half as wide triangles lessen the error of linear elements so.
FALL = 4
# Certificate of the contacts on the way, ten times that of the result, and the part of a load that
# counts as none.
ROUGH = 1e-5
# ε of the first stage in rms heights: p_f is then a smooth function of a gap next to closing.
FIRST_EPSILON = 1e-2
# Parts of a side of the patch, in each of which errors have a sign of their own.
PARTS = 4
# Largest tolerance of ln Q, whose errors are estimated to first order.
FIRST_ORDER = 0.3
# Nodes of the first network for the fluid's pressure, but every fourth sample at least: little
# beside one contact. Of the last one, at about 1 kB each, and for each sample of the contact: p_f
# is needed at the samples alone, and sixteen nodes from one to the next resolve its fall.
FIRST_NODES, MOST_NODES, MOST_PER_SAMPLE = 30_000, 4_500_000, 256
