"""Limits on memory hold as long as somebody asks for them, whoever ends first."""

import sys

import pytest

from packetmesh.memory import at_most_further


@pytest.mark.skipif(sys.platform == "win32", reason="Windows knows no such limit")
def test_the_last_of_several_limits_leaves_what_was_there_before_the_first():
    import resource

    before = resource.getrlimit(resource.RLIMIT_AS)
    first, second = at_most_further(4 << 30), at_most_further(3 << 30)
    first.__enter__()
    wide = resource.getrlimit(resource.RLIMIT_AS)[0]
    second.__enter__()
    narrow = resource.getrlimit(resource.RLIMIT_AS)[0]
    assert 0 < narrow < wide
    first.__exit__(None, None, None)
    assert resource.getrlimit(resource.RLIMIT_AS)[0] == narrow
    second.__exit__(None, None, None)
    assert resource.getrlimit(resource.RLIMIT_AS) == before
