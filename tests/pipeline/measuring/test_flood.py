"""Connected parts around a vertex."""

import numpy as np

from pipeline.measuring.lookup import Lookup
from pipeline.measuring.planes import _around
from tests.pipeline.measuring.scenes import sheet


def test_a_part_ends_where_it_may_not_be_entered():
    vertices_m, triangles, _ = sheet(6, 4, 1.0)
    lookup = Lookup(vertices_m, triangles)
    within = vertices_m[:, 0] != 3.0
    left = _around(lookup, within, int(np.argmin(vertices_m[:, 0])))
    assert np.array_equal(left, np.flatnonzero(vertices_m[:, 0] < 3.0))
    assert not len(_around(lookup, within, int(np.flatnonzero(vertices_m[:, 0] == 3.0)[0])))


def test_neighbours_are_those_of_the_edges():
    vertices_m, triangles, _ = sheet(3, 3, 1.0)
    lookup = Lookup(vertices_m, triangles)
    first, others = lookup.neighbours
    rows = np.repeat(np.arange(len(vertices_m)), np.diff(first))
    found = set(zip(rows.tolist(), others.tolist(), strict=True))
    assert found == {pair for a, b in lookup.edges.tolist() for pair in ((a, b), (b, a))}
