"""Second implementations in plain NumPy, for the tests alone.

``paper`` and ``paper_limits`` state the equations of the paper as printed, ``mended`` and its
companions compute the same things where the printed formulas fail. Neither knows the package
under test.
"""
