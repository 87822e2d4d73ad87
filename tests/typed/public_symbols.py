"""Whether all that robostiff offers has types: ``python -m tests.typed.public_symbols``."""

import json
import subprocess
import sys

#: Their bases are printers of SymPy, which has no types.
EXCEPTIONS = {
    *("robostiff.analytic.export.code.Code", "robostiff.analytic.export.language.Language"),
    "robostiff.analytic.export.notation.Notation",
    *(
        f"robostiff.analytic.export.languages.{name}"
        for name in ("TEXT", "LATEX", "MARKDOWN", "TYPST", "MATHML")
    ),
}


def main() -> int:
    """Print what lacks types, and how much has them; 1 when there is any."""
    command = ["pyright", "--verifytypes", "robostiff", "--ignoreexternal", "--outputjson"]
    found = subprocess.run(command, capture_output=True, text=True, check=False)
    symbols = json.loads(found.stdout)["typeCompleteness"]["symbols"]
    own = [one for one in symbols if one["isExported"]]
    without = [one["name"] for one in own if not one["isTypeKnown"]]
    for name in without:
        print(name, "(a printer of SymPy)" if name in EXCEPTIONS else "")
    print(f"{len(own) - len(without)} of {len(own)} public names have types")
    return int(not EXCEPTIONS.issuperset(without))


if __name__ == "__main__":
    sys.exit(main())
