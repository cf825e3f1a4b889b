"""Numbers that rule Newton's method for contact and flow."""

# An inner solve leaves a tenth of what the outer one leaves:
# * GMRES leaves a tenth of F in Newton's step, the tangents of contact and flow a tenth of that;
# * λ, which measures the errors of steps, has a tenth of theirs;
# * the stages of a thinned problem, or after difficult steps, end at a tenth of the allowed error;
# * the triangles that are not halved hold a tenth of the network's error;
# * a tenth of the allowed error is the least that is claimed: contacts are no more exact.
INNER = 0.1
# Most steps of Newton's method in a stage, and of GMRES in a step; most scenes need two to five.
# There are at most half as many stages.
MOST_STEPS = 20
