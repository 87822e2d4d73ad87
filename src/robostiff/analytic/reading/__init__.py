"""Records read as expressions: in exact fractions, in named steps, with names for lengths."""
