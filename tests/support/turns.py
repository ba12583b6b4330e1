"""Cases of a law that take turns: `make check` shows some, `make thorough` all."""

from __future__ import annotations

from collections import defaultdict

import pytest


def left_out(items: list[pytest.Item]) -> set[pytest.Item]:
    """Return the cases of laws marked `turns(n)` that are not run: all but one in n of each law.

    Places in the lists of the parameters are added up, so that the cases that stay lie on diagonals of the
    table of all cases: most values of each parameter stay. Parameters that go together count once.
    """
    laws = defaultdict(list)
    for item in items:
        if isinstance(item, pytest.Function) and item.get_closest_marker("turns"):
            laws[item.path, item.originalname].append(item)
    out: set[pytest.Item] = set()
    for cases in laws.values():
        (every,) = cases[0].get_closest_marker("turns").args  # type: ignore[union-attr]  # asked above
        columns = {tuple(case.callspec.indices[name] for case in cases) for name in cases[0].callspec.indices}
        places = zip(*columns, strict=True)
        out.update(case for case, place in zip(cases, places, strict=True) if sum(place) % every)
    return out
