"""Tables of the judged sets: aligned for a terminal, and in Markdown for a document."""

SENTENCE_MAX = 60


def text(rows):
    """A line for each set, with everything that its report says."""
    head = ("set", "hidden", "form", "named", "verdict", "tentative", "faulty", "draft", "s", "MiB", "judgement")
    return markdown(head, [cells(row) for row in rows], is_aligned=True)


def cells(row):
    return (
        row["name"],
        hidden(row),
        shortened(row["form"]),
        named(row),
        row["verdict"],
        ", ".join(row["tentative"]),
        " ".join(map(str, row["faulty"])),
        draft(row),
        number(row["seconds"]),
        number(row["peak_mib"]),
        ", ".join(row["judgement"]),
    )


def page(rows, totals, facts):
    """What a document says: the totals and a line for each set, without what is of use at a terminal alone."""
    frames, presses = facts["frames"], facts["presses"]
    at_a_time = f"{facts['jobs']} at a time" if facts["jobs"] > 1 else "one at a time"
    threads = f"{facts['threads']} threads" if facts["threads"] > 1 else "one thread"
    introduction = (
        f"Seed {facts['seed']}: {len(rows)} sets of {min(frames):,} to {max(frames):,} frames "
        f"and {min(presses)} to {max(presses)} presses, {at_a_time}, on {threads} each."
    )
    head = ("hidden", "form", "named", "verdict", "draft closes", "s", "judgement")
    lines = [
        (hidden(row), row["form"], named(row), row["verdict"], closed(row), number(row["seconds"]), ", ".join(row["judgement"]))
        for row in sorted(rows, key=order)
    ]
    return "\n\n".join((introduction, markdown(("what", "sets"), totals), markdown(head, lines)))


def order(row):
    """One effect, two, physics outside the library, nothing; each by name."""
    groups = {"outside": 2, "none": 3}
    return groups.get(row["label"][0], len(row["label"]) - 1), row["label"], row["form"]


def hidden(row):
    return " + ".join(row["label"])


def named(row):
    """The names, each with those that the data cannot tell from it."""
    return "; ".join(" or ".join(step) for step in row["named"])


def draft(row):
    """The sentence of a draft, and how much it closes of what is left."""
    if not row["draft"]:
        return ""
    sentence = shortened(row["draft"]["sentence"])
    return f"{closed(row)}: {sentence}" if closed(row) else sentence


def closed(row):
    share = (row["draft"] or {}).get("closed_share")
    return "" if share is None else f"{100 * share:.0f} %"


def shortened(sentence):
    return sentence if len(sentence) <= SENTENCE_MAX else sentence[: SENTENCE_MAX - 3].rstrip() + "..."


def number(value):
    return "-" if value is None else f"{value:.1f}"


def markdown(head, rows, is_aligned=False):
    """A table in Markdown; aligned, it is read as it stands."""
    rows = [[cell or "-" for cell in row] for row in rows]
    if not is_aligned:
        lines = [f"| {' | '.join(row)} |" for row in (head, *rows)]
        return "\n".join([lines[0], "|---" * len(head) + "|", *lines[1:]])
    widths = [max(map(len, column)) for column in zip(head, *rows, strict=True)]
    return "\n".join("  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in (head, *rows))
