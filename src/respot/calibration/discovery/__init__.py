"""Which effects the residuals show: identifiability, forward steps, permutations, held-out errors, rivals.

DESIGN section 6 is the specification; facts/calibration.md sections 2 and 8 say why each gate is there. `discover` is
the one way in.
"""
