"""The number of results of a user's function, found before it is compiled."""

from contin.functions.signature import result_count


def test_result_count_is_found_without_compiling():
    assert result_count(lambda t, u, p: (u.a, u.b, 1), (None, ("a", "b"), ()), "f") == 3
    assert result_count(lambda t, u, p: u.a, (None, ("a", "b"), ()), "f") == 0
