"""Numbers and tables as Markdown."""

import math
import statistics


def digits(value, count=3):
    """Three significant digits, thousands apart."""
    value = float(value)
    if value >= 10**count:
        return f"{value:,.0f}".replace(",", " ")
    whole = math.floor(math.log10(abs(value))) + 1 if value else 1
    return f"{value:.{min(max(count - whole, 0), 3)}f}"


def size(objects):
    objects = int(objects)
    return f"{objects:,}".replace(",", " ") if objects >= 10_000 else str(objects)


def geometric_mean(values):
    return math.exp(statistics.mean(map(math.log, values)))


def table(head, body):
    lines = [head, ["---"] * len(head), *body]
    return (
        "".join("| " + " | ".join(map(str, line)) + " |\n" for line in lines)
        .replace("| --- ", "|---")
        .replace("|--- |", "|---|")
    )
