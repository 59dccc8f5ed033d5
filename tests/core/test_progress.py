"""Progress of loops and of named steps."""

from lambent.core.progress import stepper, tracked


def record():
    seen = []
    return seen, lambda done, total, what: seen.append((done, total, what))


def test_every_item_and_the_end_are_reported():
    seen, progress = record()
    assert list(tracked("ab", progress, "letters")) == ["a", "b"]
    assert seen == [(0, 2, "letters"), (1, 2, "letters"), (2, 2, "letters")]


def test_items_are_reported_when_they_are_taken():
    seen, progress = record()
    items = tracked("ab", progress, "letters")
    next(items)
    assert len(seen) == 1


def test_steps_count_up_to_the_total():
    seen, progress = record()
    step = stepper(progress, 2)
    for what in ("first", "second", "done"):
        step(what)
    assert seen == [(0, 2, "first"), (1, 2, "second"), (2, 2, "done")]
