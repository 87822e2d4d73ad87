"""Write the JSON schema of the snapshot file to standard output."""

import sys

from robostiff.io.snapshot import schema_text

sys.stdout.write(schema_text())
