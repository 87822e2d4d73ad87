"""Connected bodies cut into series paths."""

from collections import Counter

from hypothesis import given
from hypothesis import strategies as st

from robostiff.kinematics import branches

_BODIES = st.integers(0, 7).map(str)
_PAIRS = st.lists(st.tuples(_BODIES, _BODIES).filter(lambda pair: pair[0] != pair[1]), max_size=14)


@given(_PAIRS, st.lists(_BODIES, min_size=1, max_size=2, unique=True))
def test_every_connection_is_passed_once_between_bodies_at_which_paths_branch(pairs, ends):
    degree = Counter(body for pair in pairs for body in pair)
    passed = []
    for start, end, path in branches(pairs, ends):
        body = start
        for place, (number, forward) in enumerate(path):
            a, b = pairs[number] if forward else reversed(pairs[number])
            assert a == body
            assert place == 0 or (degree[body] == 2 and body not in ends)
            body = b
        assert body == end
        is_ring = start == end and len(path) > 1
        assert is_ring or all(degree[own] != 2 or own in ends for own in (start, end))
        passed += [number for number, _ in path]
    assert sorted(passed) == list(range(len(pairs)))


def test_paths_begin_at_the_first_end():
    ((start, end, path),) = branches([("tip", "knee"), ("knee", "wall")], ["wall", "tip"])
    assert (start, end, path) == ("wall", "tip", [(1, False), (0, False)])
