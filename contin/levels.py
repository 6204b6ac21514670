"""Levels: the errors that numbers have, so that one small number is told from zero and two that are close from one.

Errors have few sources. Each source has one level: a bound on the error that it leaves, ten or more times what was measured.
A level is relative to the size of the terms that a number is computed from, or to 1 + the number's own size. A comparison takes
the level of the worse of its numbers. A tolerance of one file needs a measurement that shows that no level will do.

Each level ten times larger or smaller leaves all 124 runs of the bank right (``python scripts/constants.py``), but one: where
`LOCATED` is ten times larger.
"""

import sys

#: The smallest number of full precision: it stands for zero in logarithms and in what is divided by.
TINY = sys.float_info.min
#: Round-off of a number: a parameter that differs by no more is the same at two points, and no error is given as less. It is 16
#: units in the last place, as sums over a mesh lose a digit.
LAST_PLACES = 16 * sys.float_info.epsilon
#: What a solution of linear equations or a sum over many terms leaves of zero: 1e-16 to 1e-15 in tangents of canard explosions,
#: 1e-15 in eigenvalues of chains of masses.
ROUND_OFF = 1e-14
#: What Newton's method leaves, and what is found by bisection or by iteration to the last digit: places of special points in a
#: step, of switches in the domain, parameters that stand still, components that a symmetry makes zero. It is 1e-15 on a
#: plateau, 2e-14 of a null vector, and 3e-13 of eigenvalues of sparse matrices.
CORRECTED = 1e-12
#: A singular value, or an eigenvalue of a symmetric matrix, is zero below this part of the largest: vectors depend on each
#: other. Round-off leaves 1e-14, times the condition number of what was eliminated; slow branches near their birth have 1e-8.
DEPENDENT = 1e-10
#: What is typed, located or integrated, and all that is computed from it: symmetries typed to ten digits, sums of lengths, the
#: multiplier 1 of a conservative system (the mesh moves it by 1e-10), multipliers of symmetries (1e-11), rates of a component.
#: Ten times larger, a neutral saddle is known to 1e-8 only, matrices typed with eight digits pass for symmetries, and a cycle
#: beside a fold may count as stable; ten times smaller, the round-off of sin(10 phi) counts.
LOCATED = 1e-9
#: What round-off or an error of `CORRECTED` makes of a double number, which moves by its square root: pairs of eigenvalues that
#: are equal, the size of a cycle at its Hopf point, tangents beside a branch point (1e-8 from differences).
DOUBLED = 1e-7
#: Things that were computed independently, on two meshes, from two sides, or before and after a step, are two if they differ
#: by more: equilibria, states, orbits and the references that they are compared with. Two values of one thing differ by 1e-15
#: to 1e-9, and by 4e-7 where a multiplier 1 is double. It is also the distance beside a point at which signs are looked at. At
#: 1e-5, folds at pitchforks would be missed, as references are too old.
APART = 1e-6
#: Distance beside a point, along a tangent or as a part of a step, at which signs are looked at where tangents at the point are
#: blurred: located points are known to 1e-9 to 1e-6. Ten times larger, another special point could lie between.
BESIDE = 1e-4
#: What is known from an interpolation, a scan or differences, and what Newton's method begins from: three digits. So well the
#: cubic knows the place of a fold (2e-4 of a step); directions, multipliers that are double at a fold and orbits that have come
#: back are alike up to this.
ROUGH = 1e-3
#: A number this many times its estimated error is not zero. An error that three random roundings estimate is ten times too
#: small by chance once in 5,000 times. Ten times larger, branches of length 1e-10 would not end, and errors of 1e-10 would pass
#: where Newton's method leaves 1e-12.
CERTAIN = 10.0

# Counts of iterations, at most: an iteration that converges takes fewer.

#: Updates of Newton's method or of a secant method that begin near by: four to six do. What has not converged then will not.
MOST_UPDATES = 20
#: Halvings of an interval, or steps that divide it as well: then its ends are neighbouring numbers.
MOST_HALVINGS = 60
#: Steps of an iteration that begins far away: ten times those of one that converges.
MOST_STEPS = 100
