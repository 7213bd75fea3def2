from tactus_client.merge import Merge, Numbered


def check(before, past, after):
    """What is passed on if ``before`` arrives before the past, and ``after`` arrives after it."""
    out = []
    merge = Merge(out.append)
    for message in before:
        merge.present(message)
    assert out == [], "nothing is passed on before the past"
    merge.join(past)
    for message in after:
        merge.present(message)
    return out


def numbered(numbers, publisher="a"):
    return [Numbered(publisher, number, (publisher, number)) for number in numbers]


def items(numbers, publisher="a"):
    return [(publisher, number) for number in numbers]


def test_each_message_comes_once_for_any_overlap():
    # The past ends at `end`; live messages start at `heard`; the past arrives after `arrived`.
    for end in range(8):
        for heard in range(end + 1):
            for arrived in range(heard, 10):
                out = check(numbered(range(heard, arrived)), numbered(range(end)), numbered(range(arrived, 10)))
                assert out == items(range(10)), (end, heard, arrived)


def test_publishers_are_distinguished():
    out = check(numbered([0], "b"), numbered(range(5, 8)), numbered([1, 2], "b"))
    assert out == items(range(5, 8)) + items(range(3), "b")


def test_numbers_continue_after_the_largest():
    around = [2**32 - 2, 2**32 - 1, 0, 1]
    assert check([], numbered(around), numbered(around)) == items(around)


def test_messages_without_numbers_are_passed_on_as_they_come():
    message = Numbered(None, None, "item")
    assert check([message], [], [message]) == ["item", "item"]
