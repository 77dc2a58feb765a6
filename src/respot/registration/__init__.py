"""Registration: the rigid transform between two sets of paired points, and evidence about the pairing.

This room knows points and names only: no robots, no programs, no physical effects.
Lengths are millimetres and angles degrees at every border. A residual is always
*predicted minus reference*.
"""
