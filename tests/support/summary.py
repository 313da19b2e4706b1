# SPDX-License-Identifier: LGPL-2.1-or-later
"""summary.py LOGS: counts the cases of a run of meson test, as one last line."""
import json
import pathlib
import sys
import xml.etree.ElementTree as xml


def named(case):
    return f"{case.get('classname')}.{case.get('name')}"


logs = pathlib.Path(sys.argv[1])
cases = list(xml.parse(logs / "testlog.junit.xml").iter("testcase"))
failed = [c for c in cases if c.find("failure") is not None
          or c.find("error") is not None]
skipped = [c for c in cases if c not in failed
           and c.find("skipped") is not None]
bad = [named(c) for c in failed]

# A program that crashed or hung may have left no word on its cases.
programs = [json.loads(line) for line
            in (logs / "testlog.json").read_text().splitlines()]
broken = [p["name"] for p in programs
          if p["result"] not in ("OK", "SKIP", "EXPECTEDFAIL")]
if len(broken) > len(bad):
    bad = broken

for case in skipped:
    reason = case.find("skipped").get("message") or ""
    print("skipped:", named(case), reason)
for name in bad:
    print("failed:", name)
passed = len(cases) - len(failed) - len(skipped)
print(f"{passed} passed, {len(bad)} failed, {len(skipped)} skipped")
sys.exit(1 if bad else 0)
