"""The same derivation gives the same text, whatever the order of Python's sets."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

PROGRAM = """
import hashlib, json
from robostiff.analytic import export
from tests.analytic.export.derivations import ALL

writers = [export.derivation_text, export.derivation_latex, export.derivation_markdown,
           export.derivation_typst, export.python_function, export.c_function,
           export.julia_function, export.matlab_function,
           lambda derivation: json.dumps(export.derivation_data(derivation))]
for derivation in ALL.values():
    for writer in writers:
        print(hashlib.sha256(writer(derivation).encode()).hexdigest())
"""


@pytest.mark.slow
def test_output_does_not_depend_on_the_hash_seed():
    root = Path(__file__).parents[3]
    outputs = set()
    for seed in ("1", "2"):
        environment = {**os.environ, "PYTHONHASHSEED": seed}
        done = subprocess.run(
            [sys.executable, "-c", PROGRAM],
            cwd=root,
            env=environment,
            capture_output=True,
            text=True,
            check=True,
        )
        outputs.add(done.stdout)
    assert len(outputs) == 1
