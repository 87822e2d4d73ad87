"""``python -m tests.answers``: what differs from `answers.json`; ``--write`` writes it anew."""

import json
import sys

from tests.answers.answers import FILE, all_answers, differences, written


def main(arguments: list[str]) -> int:
    """Compare or write; 1 where anything differs."""
    now = json.loads(written(all_answers()))
    before = json.loads(FILE.read_text(encoding="utf-8")) if FILE.exists() else {}
    names = dict.fromkeys((*before, *now))
    found = [one for n in names for one in differences(n, now.get(n, {}), before.get(n, {}))]
    sys.stdout.write("\n".join([*found, f"{len(now)} machines, {len(found)} differ", ""]))
    if "--write" in arguments:
        FILE.write_text(written(now), encoding="utf-8")
        return 0
    return 1 if found else 0


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
