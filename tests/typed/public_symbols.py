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
#: Expressions of vectors are nodes of SymPy, and with them all that takes or gives one.
NODES = tuple(
    f"robostiff.analytic.vectors.{name}."
    for name in ("vector_expressions", "vector_rods", "vector_wrenches", "walk")
)


def main() -> int:
    """Print what lacks types, and how much has them; 1 when there is any."""
    command = ["pyright", "--verifytypes", "robostiff", "--ignoreexternal", "--outputjson"]
    found = subprocess.run(command, capture_output=True, text=True, check=False)
    symbols = json.loads(found.stdout)["typeCompleteness"]["symbols"]
    own = [one for one in symbols if one["isExported"]]
    without = [one["name"] for one in own if not one["isTypeKnown"]]
    left = [name for name in without if name not in EXCEPTIONS and not name.startswith(NODES)]
    for name in without:
        print(name, "" if name in left else "(a printer or a node of SymPy)")
    print(f"{len(own) - len(without)} of {len(own)} public names have types")
    return int(bool(left))


if __name__ == "__main__":
    sys.exit(main())
