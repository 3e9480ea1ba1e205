"""Waiting for what another thread or process does: until it is done, however slow the machine is, and not for a time."""
import time

ENDS_S = 240.0  # more than anything takes: whoever runs into it waits for what never comes


def until(condition, what="what is waited for"):
    """Returns once `condition`() holds."""
    end = time.monotonic() + ENDS_S
    while not condition():
        assert time.monotonic() < end, f"{what} did not come about within {ENDS_S:g} s"
        time.sleep(0.002)
