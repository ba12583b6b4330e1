"""One module a peer, each run in an environment of its own by worker.py, needing NumPy and the peer alone.

A module offers ``make(problem)``, which returns a dictionary of named rows. A row is a `Solver`, a `Batch`
or an `Arcs` of `contract`. The peers are used as their own documentation says, with these common terms: joint
limits on, an answer within 1e-6 m and 1e-6 rad asked for, restarts from random joints where a peer has none
of its own.
"""
