"""What the comparisons share: a row of `consac bench` and the same work of another program, in turn, both by the processor's seconds (what
else the machine does counts for neither), and the median of the pairs."""
import json
import statistics
import subprocess

PAIRS = 5


def bench_row(consac, name):
    """A row of `consac bench` that trains, once: {"value", "unit", "seconds", ...}, and the machine with its kernels."""
    text = subprocess.run([consac, "bench", "--only", name, "--repeats", "1", "--processor-time", "--json"], capture_output=True, text=True, check=True).stdout
    found = json.loads(text)
    return found["rows"][0], f"{found['cpu']}, {found['kernels']} kernels"


def rate(consac, name):
    """Steps or updates a second of such a row, whichever it counts."""
    return 1e3 * bench_row(consac, name)[0]["value"]


def in_turn(ours, theirs, pairs=PAIRS):
    """[(what `ours` gives, what `theirs` gives)]."""
    return [(ours(), theirs()) for _ in range(pairs)]


def medians(pairs):
    """Of ours, of theirs, and of ours / theirs within a pair."""
    return tuple(map(statistics.median, zip(*((a, b, a / b) for a, b in pairs))))
