"""What a report is worth, given what is hidden, in the terms of docs/discovery-evidence.md."""

import itertools
import statistics

OUTSIDE, NONE = "outside", "none"
NO_REPORT = "no report"
EXACT, IN_SET, ONE_OF_TWO, WRONG = "exact", "in the set", "one of two", "wrong name"
NOT_NAMED, NOT_SEEN = "seen, not named", "not seen"
UNEXPLAINED, DRAFTED = "unexplained", "drafted"
RIGHT, FALSE_ALARM = "right", "false alarm"


def judgement(labels, report):
    """What the report says, and how that is judged; no report and one that judges nothing count alike."""
    if report is None:
        return {"named": [], "verdict": "failed", "tentative": [], "draft": None, "faulty": [], "judgement": [NO_REPORT]}
    said = {
        "named": [[step["effect"], *map(effect, step["equivalent"])] for step in report["steps"]],
        "verdict": report["verdict"],
        "tentative": [effect(one) for one in report["tentative"]],
        "draft": drafted(report["draft"]),
        "faulty": [one["element"] for one in report["faulty"]],
    }
    return {**said, "judgement": words_for(labels, said)}


def words_for(labels, said):
    """How the hidden physics is named, and whether another name is given."""
    if said["verdict"] == "cannot-judge":
        return [NO_REPORT]
    named = said["named"]
    is_seen = bool(named) or said["verdict"] != "nothing-missing"
    if labels == [NONE]:
        return [FALSE_ALARM if is_seen else RIGHT]
    if labels == [OUTSIDE]:
        unnamed = DRAFTED if said["draft"] else UNEXPLAINED if is_seen else NOT_SEEN
        return [WRONG] if named else [unnamed]
    hits = [step for step in named if set(labels) & set(step)]
    words = [WRONG] if len(hits) < len(named) else []
    if sorted(step[0] for step in named) == sorted(labels):
        return [EXACT]
    if covers(named, labels):
        return [IN_SET, *words]
    if hits:
        return [ONE_OF_TWO, *words]
    return words or [NOT_NAMED if is_seen else NOT_SEEN]


def covers(named, labels):
    """True if every label is in a reported set, each in a different one."""
    choices = itertools.permutations(named, len(labels))
    return any(all(label in step for label, step in zip(labels, steps, strict=True)) for steps in choices)


def drafted(draft):
    """The draft, or None; an object without a sentence says why there is none."""
    return {key: draft.get(key) for key in ("sentence", "closed_share")} if draft and draft.get("sentence") else None


def effect(one):
    """A list holds names, or objects that have them."""
    return one if isinstance(one, str) else one["effect"]


def totals(rows):
    """Counts of judgements, each of all sets of its kind, and costs."""
    kinds = {
        "one effect": [row for row in rows if len(row["label"]) == 1 and row["label"][0] not in (OUTSIDE, NONE)],
        "two effects": [row for row in rows if len(row["label"]) == 2],
        "outside the library": [row for row in rows if row["label"] == [OUTSIDE]],
        "nothing hidden": [row for row in rows if row["label"] == [NONE]],
    }
    asked = {
        "one effect": {
            "named exactly": (EXACT,),
            "in the reported set": (EXACT, IN_SET),
            "a wrong name": (WRONG,),
            "seen without a name": (NOT_NAMED,),
            "not seen": (NOT_SEEN, NO_REPORT),
        },
        "two effects": {
            "both named exactly": (EXACT,),
            "both in reported sets": (EXACT, IN_SET),
            "one of them": (ONE_OF_TWO,),
            "a wrong name": (WRONG,),
            "seen without a name": (NOT_NAMED,),
            "not seen": (NOT_SEEN, NO_REPORT),
        },
        "outside the library": {
            "unexplained": (UNEXPLAINED, DRAFTED),
            "unexplained and drafted": (DRAFTED,),
            "a wrong name": (WRONG,),
            "not seen": (NOT_SEEN, NO_REPORT),
        },
        "nothing hidden": {"false alarms": (FALSE_ALARM, NO_REPORT)},
    }
    lines = []
    for kind, questions in asked.items():
        of = kinds[kind]
        for question, words in questions.items():
            lines.append((f"{kind}: {question}", f"{sum(not set(words).isdisjoint(row['judgement']) for row in of)} of {len(of)}"))
    lines.append((NO_REPORT, f"{sum(NO_REPORT in row['judgement'] for row in rows)} of {len(rows)}"))
    for name, key in (("s, median and greatest", "seconds"), ("MiB, median and greatest", "peak_mib")):
        values = [row[key] for row in rows if row[key] is not None]
        if values:
            lines.append((name, f"{statistics.median(values):.1f}, {max(values):.1f}"))
    return lines
