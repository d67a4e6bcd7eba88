"""Whole numbers in order."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from pipeline.kernels.ordering import stable_order


@given(st.lists(st.one_of(st.integers(0, 3), st.integers(0, 2**63 - 1)), max_size=40))
def test_it_is_the_order_of_a_stable_sort(keys):
    expected = sorted(range(len(keys)), key=keys.__getitem__)
    assert stable_order(np.array(keys, np.int64)).tolist() == expected


def test_any_kind_of_whole_number_will_do():
    for kind in (np.uint8, np.int32, np.int64):
        assert stable_order(np.array([3, 1, 2, 1], kind)).tolist() == [1, 3, 2, 0]
        assert stable_order(np.array([3, 9, 1, 9, 2], kind)[::2]).tolist() == [1, 2, 0]
