#!/usr/bin/env python3
"""Adds up CTest's JUnit files and the stages of .ci/run; prints the closing line and exits 1 when anything failed.
Usage: count_tests.py STAGES_PASSED STAGES_FAILED JUNIT.xml..."""
import sys
import xml.etree.ElementTree as xml

passed, failed, skipped = int(sys.argv[1]), int(sys.argv[2]), 0
for path in sys.argv[3:]:
    for case in xml.parse(path).getroot().iter("testcase"):
        status = case.get("status")
        if status == "fail":
            failed += 1
            print(f"failed: {case.get('name')} ({path})")
        elif status in ("disabled", "notrun"):
            skipped += 1
        else:
            passed += 1
print(f"{passed} passed, {failed} failed, {skipped} skipped")
sys.exit(1 if failed else 0)
