"""The percolation and leakage of self-affine contacts, as in the 2012 letter, with error bars.

W. B. Dapp, A. Lücke, B. N. J. Persson, M. H. Müser, Phys. Rev. Lett. 108, 244301 (2012). From a
checkout of the project: python -m demos.letter.reproduce --size 256 (docs/theory/letter.md).
"""
